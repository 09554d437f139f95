"""The possible positions of the table's reference, and the measured positions; no I/O."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

from protocol.trapezoid import Motion, MotionCommand, ReferenceState

_DELAYS = ((0.0,), (-1.0,), (1.0,), (-1.0, 1.0), (1.0, -1.0))
"""The times at which commands were executed, within their uncertainty.

Each choice of times gives one possible course of a motion.
"""


class Instant(NamedTuple):
    """A time that is known to lie in a window: its middle and its half width."""

    middle_s: float
    half_width_s: float


class Sample(NamedTuple):
    """A position that the table reported: the middle and the half width of the time at which it was valid."""

    time_s: float
    position_deg: float
    uncertainty_s: float


class Expectation(NamedTuple):
    """A commanded motion, and its start time."""

    began_s: float
    motion: Motion

    def at(self, time_s: float) -> ReferenceState:
        """Return the position and speed of the reference."""
        return self.motion.at(time_s - self.began_s)


@dataclass
class MotionRecord:
    """Expected and measured values of a table in motion."""

    expectations: list[Expectation] = field(default_factory=list)
    samples: list[Sample] = field(default_factory=list)


class Reference:
    """The possible courses of the reference, one for each combination of command times.

    In the first course, each command is executed in the middle of its window.
    """

    def __init__(self, expectations: list[Expectation]) -> None:
        """Use the list in which the first course is stored."""
        self._expectations = expectations
        self._courses: list[list[Expectation]] = []

    def stand_at(self, time_s: float, angle_deg: float) -> None:
        """Start at rest at an angle at a time. Earlier uncertainty ends there."""
        resting = Expectation(time_s, Motion.at_rest(angle_deg))
        self._expectations.append(resting)
        self._courses = [self._expectations, *([resting] for _ in _DELAYS[1:])]

    def move(
        self, instant: Instant, target_from: Callable[[float], float], top_deg_s: float, rate_deg_s2: float
    ) -> None:
        """Start another motion at an instant. Its target may depend on the position of the reference at that time."""
        for course, delays in zip(self._courses, _DELAYS, strict=True):
            began_s = instant.middle_s + instant.half_width_s * delays[len(course) % len(delays)]
            state = _at(course, began_s)
            motion = Motion.of(state, MotionCommand(target_from(state.angle_deg), top_deg_s, rate_deg_s2))
            course.append(Expectation(began_s, motion))

    def at(self, time_s: float) -> ReferenceState:
        """Return the position of the reference at a time, and its speed."""
        return _at(self._expectations, time_s)

    def span_deg(self, instant: Instant) -> tuple[float, float]:
        """Return the minimum and maximum possible position of the reference at an instant."""
        positions = [
            _at(course, instant.middle_s + offset_s)[0]
            for course in self._courses
            for offset_s in (-instant.half_width_s, 0.0, instant.half_width_s)
        ]
        return min(positions), max(positions)

    def target_span_deg(self) -> tuple[float, float]:
        """Return the minimum and maximum target. The target of an increment is as uncertain as its time."""
        targets = [course[-1].motion.target_deg for course in self._courses]
        return min(targets), max(targets)


def _at(course: Sequence[Expectation], time_s: float) -> ReferenceState:
    running = next((one for one in reversed(course) if one.began_s <= time_s), course[0])
    return running.at(time_s)
