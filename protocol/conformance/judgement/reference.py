"""Where the table's reference can have been, and what was seen beside it; nothing here talks to a table."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

from protocol.trapezoid import Motion, MotionCommand, ReferenceState

_DELAYS = ((0.0,), (-1.0,), (1.0,), (-1.0, 1.0), (1.0, -1.0))
"""When commands were carried out, within the times that they leave open: the courses that a motion may have taken."""


class Instant(NamedTuple):
    """A time that is known to lie within a window: its middle and its half width."""

    middle_s: float
    half_width_s: float


class Sample(NamedTuple):
    """A position that the table reported: the middle and the half width of the time in which it was so."""

    time_s: float
    position_deg: float
    uncertainty_s: float


class Expectation(NamedTuple):
    """A commanded motion, and the time at which it began."""

    began_s: float
    motion: Motion

    def at(self, time_s: float) -> ReferenceState:
        """Return where the reference should be, and at what speed."""
        return self.motion.at(time_s - self.began_s)


@dataclass
class MotionRecord:
    """What was expected and what was seen of a table in motion."""

    expectations: list[Expectation] = field(default_factory=list)
    samples: list[Sample] = field(default_factory=list)


class Reference:
    """The courses that the reference may have taken, one for each way in which its commands may have been timed.

    The first is that with each command carried out in the middle of its time.
    """

    def __init__(self, expectations: list[Expectation]) -> None:
        """Take the list in which the first course is kept."""
        self._expectations = expectations
        self._courses: list[list[Expectation]] = []

    def stand_at(self, time_s: float, angle_deg: float) -> None:
        """Rest at an angle from a time on: what was open before is known now."""
        resting = Expectation(time_s, Motion.at_rest(angle_deg))
        self._expectations.append(resting)
        self._courses = [self._expectations, *([resting] for _ in _DELAYS[1:])]

    def move(
        self, instant: Instant, target_from: Callable[[float], float], top_deg_s: float, rate_deg_s2: float
    ) -> None:
        """Take another motion at an instant; its target may depend on where the reference is then."""
        for course, delays in zip(self._courses, _DELAYS, strict=True):
            began_s = instant.middle_s + instant.half_width_s * delays[len(course) % len(delays)]
            state = _at(course, began_s)
            motion = Motion.of(state, MotionCommand(target_from(state.angle_deg), top_deg_s, rate_deg_s2))
            course.append(Expectation(began_s, motion))

    def at(self, time_s: float) -> ReferenceState:
        """Return where the reference should be at a time, and its speed."""
        return _at(self._expectations, time_s)

    def span_deg(self, instant: Instant) -> tuple[float, float]:
        """Return the least and the greatest position at which the reference can have been at an instant."""
        positions = [
            _at(course, instant.middle_s + offset_s)[0]
            for course in self._courses
            for offset_s in (-instant.half_width_s, 0.0, instant.half_width_s)
        ]
        return min(positions), max(positions)

    def target_span_deg(self) -> tuple[float, float]:
        """Return the least and the greatest target; that of an increment is as open as its moment."""
        targets = [course[-1].motion.target_deg for course in self._courses]
        return min(targets), max(targets)


def _at(course: Sequence[Expectation], time_s: float) -> ReferenceState:
    running = next((one for one in reversed(course) if one.began_s <= time_s), course[0])
    return running.at(time_s)
