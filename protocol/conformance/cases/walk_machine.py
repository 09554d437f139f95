"""The steps of a random walk, each with a model of the registers that predicts the reply."""

from collections.abc import Callable
from typing import Any

from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, precondition, rule

from protocol.conformance.bench.stand import TRIGGER
from protocol.conformance.judgement.rig import Rig
from protocol.conformance.judgement.verdict import NonconformityError, require
from protocol.conformance.judgement.wire_checks import number
from protocol.messages import ErrorCode

_REFUSED = (
    (b"?", ErrorCode.UNKNOWN_COMMAND),
    (b"R 1,5", ErrorCode.BAD_NUMBER),
    (b"S 0", ErrorCode.OUT_OF_RANGE),
    (b"P 99999999999", ErrorCode.OUT_OF_RANGE),
    (b"R 5".ljust(33), ErrorCode.LINE_TOO_LONG),
    (b"R 5\x18", ErrorCode.BAD_BYTE),
)


def _step(action: Callable[..., None]) -> Callable[..., None]:
    """Give a rule its name and numbers, and turn its finding into the failure that the search expects."""

    def run(self: "RandomWalk", **arguments: Any) -> None:  # noqa: ANN401  # whatever the rule draws
        self.steps.append(" ".join([action.__name__.strip("_"), *map(str, arguments.values())]))
        try:
            action(self, **arguments)
        except NonconformityError as error:
            raise self.failure(f"{error}; after {', '.join(self.steps)}") from None

    run.__name__ = action.__name__
    return run


def _tenths(least: float, most: float) -> st.SearchStrategy[float]:
    return st.integers(round(10 * least), round(10 * most)).map(lambda tenths: tenths / 10)


def _whole_and_tenth(least: int, most: int) -> st.SearchStrategy[float]:
    """Draw from `least` to just below `most` in steps of 0.1, in two draws.

    hypothesis also draws constants of 100 and more that it finds in the modules of the user. A seed must give the same
    walk beside any of them, so every draw of a walk stays below 100.
    """
    parts = st.tuples(st.integers(least, most - 1), st.integers(0, 9))
    return parts.map(lambda drawn: (10 * drawn[0] + drawn[1]) / 10)


_FAR = st.sampled_from((-9.0, -5.0, 5.0, 9.0))
_SHARE = st.sampled_from((0.25, 0.5, 1.5))
"""Share of the present S or A; a smaller change would not be visible."""
_POLL_S = 0.03


class RandomWalk(RuleBasedStateMachine):
    """The six commands, waits, triggers and refused lines, in any order.

    The model: S and A, the trapezoid of the reference, and the latch, which is unknown until it is read.
    """

    rig: Rig
    failure: Callable[[str], BaseException]

    def __init__(self) -> None:
        super().__init__()
        self.steps: list[str] = []
        self.latch: tuple[float, float] | None = None
        self._go_home()
        allowed = self.rig.profile.motion
        self.rig.settings(min(20, allowed.speed_deg_s), min(40, allowed.acceleration_deg_s2))

    @_step
    def _go_home(self) -> None:
        self.rig.go_home()
        self.rig.stand_at_home()

    @rule(value=_whole_and_tenth(2, 20))
    @_step
    def set_speed(self, value: float) -> None:
        """Set S."""
        self.rig.set_speed(min(value, self.rig.profile.motion.speed_deg_s))

    @rule(value=_whole_and_tenth(20, 80))
    @_step
    def set_acceleration(self, value: float) -> None:
        """Set A."""
        self.rig.set_acceleration(min(value, self.rig.profile.motion.acceleration_deg_s2))

    @rule(angle=_tenths(-9.9, 9.9))
    @_step
    def move_to(self, angle: float) -> None:
        """Command P."""
        self.rig.move_to(angle)

    @rule(way=_tenths(-3, 3))
    @_step
    def move_by(self, way: float) -> None:
        """Command R."""
        self.rig.move_by(way)

    @rule(angle=_FAR, seconds=_tenths(0.1, 0.3), share=_SHARE, preempts=st.booleans())
    @_step
    def set_speed_in_motion(self, angle: float, seconds: float, share: float, preempts: bool) -> None:
        """Set S during a motion. The motion continues, and the next one uses the new value."""
        allowed = self.rig.profile.motion
        self.rig.settings(min(10, allowed.speed_deg_s), min(60, allowed.acceleration_deg_s2))
        speed_deg_s = _changed(self.rig.top_deg_s, share, allowed.speed_deg_s)
        self._in_motion(angle, seconds, lambda: self.rig.set_speed(speed_deg_s), preempts)

    @rule(angle=_FAR, seconds=_tenths(0.1, 0.3), share=_SHARE, preempts=st.booleans())
    @_step
    def set_acceleration_in_motion(self, angle: float, seconds: float, share: float, preempts: bool) -> None:
        """Set A during a motion. The motion continues, and the next one uses the new value."""
        allowed = self.rig.profile.motion
        self.rig.settings(min(20, allowed.speed_deg_s), min(40, allowed.acceleration_deg_s2))
        rate_deg_s2 = _changed(self.rig.rate_deg_s2, share, allowed.acceleration_deg_s2)
        self._in_motion(angle, seconds, lambda: self.rig.set_acceleration(rate_deg_s2), preempts)

    def _in_motion(self, angle: float, seconds: float, change: Callable[[], None], preempts: bool) -> None:
        """Start a motion, change a setting during it, and start the next one, during or after that motion."""
        self.rig.move_to(angle)
        self._sample_for(seconds)
        change()
        self._sample_for(0.1)
        if not preempts:
            self.rig.wire.clock.sleep_s(self._left_s())
        self.rig.move_to(-angle)
        self._sample_for(0.5)

    def _left_s(self) -> float:
        """Return the remaining time of the motion."""
        last = self.rig.motion.expectations[-1]
        return max(0.0, last.began_s + last.motion.duration_s - self.rig.wire.clock.now_s())

    @rule(seconds=_tenths(0, 0.5))
    @_step
    def wait(self, seconds: float) -> None:
        """Advance the time."""
        self.rig.wire.clock.sleep_s(seconds)

    @rule()
    @_step
    def read_position(self) -> None:
        """Read the position, which the trapezoid predicts."""
        self._sample()

    @rule()
    @_step
    def read_latch(self) -> None:
        """Read the latch, which keeps its value."""
        latched = float(self.rig.read(b"L"))
        if self.latch is None:
            self.latch = latched, latched
        low, high = self.latch
        require(low <= latched <= high, f"the latch is {latched}, not {low:g} to {high:g} deg")
        self.latch = latched, latched

    @precondition(lambda self: TRIGGER in self.rig.stand.capabilities)
    @rule()
    @_step
    def trigger(self) -> None:
        """Trigger between two readings: the latch lies between them."""
        before = self._sample()
        self.rig.stand.trigger()
        after = self._sample()
        open_deg = self.rig.profile.resolution_deg + self.rig.profile.tolerance.tracking_deg  # a turn between the two
        self.latch = min(before, after) - open_deg, max(before, after) + open_deg

    @rule(refused=st.sampled_from(_REFUSED))
    @_step
    def be_refused(self, refused: tuple[bytes, ErrorCode]) -> None:
        """Send a line that changes nothing."""
        self.rig.refused(*refused)

    @rule(letters=st.lists(st.sampled_from((b"H", b"L")), min_size=2, max_size=6))
    @_step
    def read_several_at_once(self, letters: list[bytes]) -> None:
        """Send several readings in one write."""
        self.rig.wire.send(b"".join(letter + b"\r" for letter in letters))
        for letter in letters:
            self.rig.angle_in(self.rig.reply_to(letter), letter)

    @rule(half=st.sampled_from((b"R 5", b"P", b"H", b"S 1")))
    @_step
    def cancel(self, half: bytes) -> None:
        """Send an incomplete line, and cancel it."""
        self.rig.wire.send(half)
        self.rig.refused(b"\x18", ErrorCode.BAD_BYTE)

    @rule()
    @_step
    def come_to_rest(self) -> None:
        """Wait for the end of the motion, and read the position."""
        self.rig.follow()
        resting = float(self.rig.wait_for_rest())
        last = self.rig.motion.expectations[-1]
        low, high = self.rig.resting_range()
        require(low <= resting <= high, f"at rest at {resting:g} deg, allowed {low:.3f} to {high:.3f}")
        # The end position is known now, although the start time of an increment was not.
        self.rig.expect(b"P " + number(last.motion.target_deg))
        self.rig.wait_for_rest()
        self.rig.stand_at(last.motion.target_deg)

    def teardown(self) -> None:
        """Leave the table at rest. A failure has already been reported."""

    def _sample_for(self, seconds: float) -> None:
        until_s = self.rig.wire.clock.now_s() + seconds
        while self.rig.wire.clock.now_s() < until_s:
            self._sample()
            self.rig.wire.clock.sleep_s(_POLL_S)

    def _sample(self) -> float:
        sample = self.rig.sample()
        excess = self.rig.excess(sample)
        require(
            excess <= self.rig.profile.tolerance.tracking_deg,
            f"the table is {excess:.3g} deg from the possible range of its reference, at {sample.position_deg:g} deg",
        )
        return sample.position_deg


def _changed(value: float, share: float, allowed: float) -> float:
    """Return a value changed by a share, in the other direction where the profile does not allow the result."""
    return value * share if value * share <= allowed else value / share
