"""The position of the table's reference, predicted from the commands of a client; no I/O.

The prediction starts when the client observes the table at rest. It ends when the start or the profile of a motion is
uncertain, or when a reading contradicts it. Then nothing is known until the table rests again.
"""

from typing import NamedTuple

from protocol.messages import Command, Verb
from protocol.trapezoid import Motion, MotionCommand, ReferenceState

# A reading this far from the prediction contradicts it: the following error of a correct table is smaller.
_STRAYED_DEG = 1.0


class PredictedReference(NamedTuple):
    """The known state of the reference; None for what is not known.

    Attributes:
        speed_deg_s: S for the next motion.
        acceleration_deg_s2: A for the next motion.
        target_deg: target of the last commanded motion.
        motion: the last commanded motion.
        began_s: its start time, on the client's clock.
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
        """Return the prediction after the table has executed a command at a time."""
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
        """Return the prediction when it is not known whether a command of this verb was executed."""
        if verb is Verb.SET_SPEED:
            return self._replace(speed_deg_s=None)
        return self._replace(acceleration_deg_s2=None) if verb is Verb.SET_ACCELERATION else self

    def seen(self, position_deg: float, begin_s: float, end_s: float) -> "PredictedReference":
        """Return the prediction after a reading that was taken between two times."""
        if self.motion is None:
            return self
        positions = [self.motion.at(time_s - self.began_s)[0] for time_s in (begin_s, 0.5 * (begin_s + end_s), end_s)]
        off_deg = max(min(positions) - position_deg, position_deg - max(positions))
        return self._replace(motion=None) if off_deg > _STRAYED_DEG else self

    def resting(self, angle_deg: float, time_s: float) -> "PredictedReference":
        """Return the prediction for a table that was observed at rest."""
        return self._replace(motion=Motion.at_rest(angle_deg), target_deg=angle_deg, began_s=time_s)

    @property
    def rests_s(self) -> float | None:
        """The time at which the reference rests at its target."""
        return None if self.motion is None else self.began_s + self.motion.duration_s
