"""Where the table's reference is, predicted from the commands that a client sent; no I/O.

The prediction begins where a client has seen the table at rest. It ends when a command leaves the start or the profile
of a motion open, or when a reading contradicts it: from then on nothing is known until the table rests again.
"""

from typing import NamedTuple

from protocol.messages import Command, Verb
from protocol.trapezoid import Motion, MotionCommand, ReferenceState

# A reading this far from the prediction refutes it: more than a sound table lags behind.
_STRAYED_DEG = 1.0


class PredictedReference(NamedTuple):
    """What is known of the reference; None for what is not.

    Attributes:
        speed_deg_s: S for the next motion.
        acceleration_deg_s2: A for the next motion.
        target_deg: of the motion that was commanded last.
        motion: the motion that was commanded last.
        began_s: when it began, on the client's clock.
    """

    speed_deg_s: float | None = None
    acceleration_deg_s2: float | None = None
    target_deg: float | None = None
    motion: Motion | None = None
    began_s: float = 0.0

    def at(self, time_s: float) -> ReferenceState | None:
        """Return position (deg) and speed (deg/s) at a time."""
        return None if self.motion is None else self.motion.at(time_s - self.began_s)

    def after(self, command: Command, time_s: float) -> "PredictedReference":
        """Return the prediction once the table has carried out a command at a time."""
        if command.value is None:
            return self
        value = float(command.value)
        if command.verb is Verb.SET_SPEED:
            return self._replace(speed_deg_s=value)
        if command.verb is Verb.SET_ACCELERATION:
            return self._replace(acceleration_deg_s2=value)
        state, top, rate = self.at(time_s), self.speed_deg_s, self.acceleration_deg_s2
        target_deg = value if command.verb is Verb.MOVE_TO else None if state is None else state[0] + value
        if state is None or target_deg is None or not top or not rate:
            return self._replace(motion=None, target_deg=target_deg)
        return self._replace(
            motion=Motion.of(state, MotionCommand(target_deg, top, rate)), target_deg=target_deg, began_s=time_s
        )

    def without_setting(self, verb: Verb) -> "PredictedReference":
        """Return the prediction when it is open whether a command of this verb was carried out."""
        if verb is Verb.SET_SPEED:
            return self._replace(speed_deg_s=None)
        return self._replace(acceleration_deg_s2=None) if verb is Verb.SET_ACCELERATION else self

    def seen(self, position_deg: float, begin_s: float, end_s: float) -> "PredictedReference":
        """Return what is left of the prediction after a reading of an instant between two times."""
        if self.motion is None:
            return self
        positions = [self.motion.at(time_s - self.began_s)[0] for time_s in (begin_s, 0.5 * (begin_s + end_s), end_s)]
        off_deg = max(min(positions) - position_deg, position_deg - max(positions))
        return self._replace(motion=None) if off_deg > _STRAYED_DEG else self

    def resting(self, angle_deg: float, time_s: float) -> "PredictedReference":
        """Return the prediction for a table that was seen to rest."""
        return self._replace(motion=Motion.at_rest(angle_deg), target_deg=angle_deg, began_s=time_s)

    @property
    def rests_s(self) -> float | None:
        """When the reference is at its target and stands."""
        return None if self.motion is None else self.began_s + self.motion.duration_s
