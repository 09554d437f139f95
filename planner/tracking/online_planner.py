"""The planner of a table that moves: one step at a time, from what is known, always with a motion to rest in hand.

A step is decided from the state that the step before ends in. It is taken only if a motion to rest exists from its end
(`rest_motion`); that motion is kept. Where no decision is taken, in time or at all, the kept motion goes on. So at any
moment the table comes to rest within the columns in view, and nothing is decided from a column that is not known.

At rest the scan waits for locations. Where the next location cannot be reached in a step, it pauses: the probe
retracts, the table turns, and the probe approaches at the next location (Algorithm 1).
"""

from collections import deque
from collections.abc import Callable
from enum import StrEnum
from typing import NamedTuple

import numpy as np

from planner.arrays import FloatArray
from planner.kernel import kernel
from planner.map.config_map import column_value
from planner.plans.problem import Terms
from planner.table.motion import next_angle, next_speed
from planner.tracking.decision import Candidate, Method, safe_candidates
from planner.tracking.followed_arm import FollowedArm
from planner.tracking.rest_motion import HALT
from planner.tracking.revealed_map import RevealedMap

_STANDING_DEG_S = 1e-9
# Cheapest steps that are tried on the arm before the kept motion goes on.
_ARM_TRIALS = 8

Goals = Callable[[int, int], FloatArray]
"""From a first and a last location to the arm's goals (n, 4, 4) there, both included."""


class Kind(StrEnum):
    """What a step of the clock is."""

    SCAN = "scan"
    WAIT = "wait"
    HALT = "halt"
    PAUSE = "pause"


class Why(StrEnum):
    """Why a step is what it is."""

    DECIDED = "decided"
    NOTHING_BETTER = "no other step leaves a way to rest"
    NOT_IN_TIME = "the decision was not ready in time"
    NO_LOCATION = "no location is known"


class State(NamedTuple):
    """Where the table is: at which location, its angle and speed; and the arm's joints (6,) in radians, if asked."""

    location: int
    angle_deg: float
    speed_deg_s: float
    joints: FloatArray | None = None

    @property
    def is_at_rest(self) -> bool:
        """Whether the table stands."""
        return abs(self.speed_deg_s) <= _STANDING_DEG_S


class KeptStep(NamedTuple):
    """A step of a motion to rest."""

    acceleration_deg_s2: float
    end: State
    halts: bool = False
    """Whether the table comes to rest at the location where it is: it passes the angle and comes back."""


class Step(NamedTuple):
    """A step of the clock: one location farther at constant acceleration, or standing.

    Attributes:
        kind: what goes on; in a pause the table turns from rest to rest and the next location is reached.
        why: who chose it.
        start: the state before it.
        end: the state after it.
        acceleration_deg_s2: 0 in a wait or a pause.
        last_known: the last location that was known.
        kept: the motion to rest from its end; none where the table rests.
    """

    kind: Kind
    why: Why
    start: State
    end: State
    acceleration_deg_s2: float
    last_known: int
    kept: tuple[KeptStep, ...]

    @property
    def rest(self) -> State:
        """Where the table comes to rest if nothing else is decided."""
        return self.kept[-1].end if self.kept else self.end


class Blocked(NamedTuple):
    """The scan cannot go on: no table angle of the next location is allowed. The table stands."""

    location: int


class OnlinePlanner:
    """The state of the table, and the motion to rest that is kept.

    Attributes:
        state: where the table is after the last step.
        revealed: the known columns.
        ended: whether no more locations come.
    """

    def __init__(
        self,
        revealed: RevealedMap,
        method: Method,
        start: State,
        margin_deg: float,
        resume_columns: int,
        arm: FollowedArm | None = None,
        goals: Goals | None = None,
    ) -> None:
        """Begin at rest.

        Args:
            revealed: the known columns; the first is that of the start.
            method: how steps are rated.
            start: at rest, at an allowed angle.
            margin_deg: distance that the table keeps from what is forbidden.
            resume_columns: so many columns must be known before the table leaves a rest that it came to for want of
                them, unless the path ends before.
            arm: the arm that has to follow; None for the table alone.
            goals: the arm's goals at the known locations.
        """
        self.revealed, self.state, self.ended = revealed, start, False
        self._method, self._margin_deg, self._resume_columns = method, margin_deg, resume_columns
        self._arm, self._goals = arm, goals
        self._kept: deque[KeptStep] = deque()

    @property
    def is_finished(self) -> bool:
        """Whether the table rests at the last location of the path."""
        return self.ended and self.state.is_at_rest and self.state.location == self.revealed.last

    @property
    def kept(self) -> tuple[KeptStep, ...]:
        """The motion that comes to rest within the columns in view; none where the table rests."""
        return tuple(self._kept)

    def step(self, may_decide: bool = True) -> Step | Blocked:
        """Return the next step, and take it.

        Args:
            may_decide: False where there is no time to decide: the kept motion goes on.
        """
        candidate_path = self._decided() if may_decide else None
        if candidate_path is not None:
            self._kept = deque(candidate_path)
            return self._go_on(Why.DECIDED)
        if self._kept:
            return self._go_on(Why.NOTHING_BETTER if may_decide else Why.NOT_IN_TIME)
        if not may_decide:
            return self._wait(Why.NOT_IN_TIME)
        if not self._may_leave():
            return self._wait(Why.NO_LOCATION)
        return self.pause()

    def pause(self) -> Step | Blocked:
        """Return the pause that ends at rest at the next location, which is known, and take it."""
        assert self.state.is_at_rest
        start, location = self.state, self.state.location + 1
        for angle_deg in self._angles_after_pause():
            joints = self._arrive(location, angle_deg)
            if self._arm is None or joints is not None:
                self.state = State(location, angle_deg, 0.0, joints)
                self.revealed.forget_before(location)
                return Step(Kind.PAUSE, Why.DECIDED, start, self.state, 0.0, self.revealed.last, ())
        return Blocked(location)

    def rehearse(self) -> None:
        """Decide without taking the step, so that the first decision finds its machine code loaded."""
        self._decided()

    def change(self, revealed: RevealedMap, arm: FollowedArm) -> None:
        """Go on in another arm configuration; the table rests, and a pause comes next."""
        self.revealed, self._arm = revealed, arm

    def _decided(self) -> list[KeptStep] | None:
        """Return the cheapest safe step that the arm can follow, with its motion to rest; None: there is none."""
        if self.state.is_at_rest and not self._may_leave():
            return None
        window = self.revealed.window(self.state.location)
        candidates = safe_candidates(
            self._method, self.revealed.online, window, self.state.angle_deg, self.state.speed_deg_s, self._margin_deg
        )
        if self._arm is not None:
            # In a halt the table turns under an arm that stands, and the map rates only an arm that follows the table.
            candidates = (each for each in candidates if each.braking_steps != HALT)
        for _, candidate in zip(range(_ARM_TRIALS), candidates, strict=False):
            path = self._followed(self._path_of(candidate, window.terms.step_s))
            if path is not None:
                return path
        return None

    def _may_leave(self) -> bool:
        """Return whether enough is known to leave a rest."""
        ahead = self.revealed.last - self.state.location
        return ahead >= (1 if self.ended else self._resume_columns)

    def _path_of(self, candidate: Candidate, step_s: float) -> list[KeptStep]:
        """Return a step and its braking to rest; the speed at the end is exactly 0."""
        if candidate.braking_steps == HALT:
            state = self._after(candidate.acceleration_deg_s2, step_s)
            halt = KeptStep(0.0, state._replace(speed_deg_s=0.0), halts=True)
            return [KeptStep(candidate.acceleration_deg_s2, state), halt]
        state, path = self.state, []
        for k in range(1 + candidate.braking_steps):
            if k == 1:
                braking = -state.speed_deg_s / (candidate.braking_steps * step_s)
            a = braking if k else candidate.acceleration_deg_s2
            speed = next_speed(state.speed_deg_s, a, step_s)
            if k == candidate.braking_steps:
                speed = 0.0
            state = State(state.location + 1, next_angle(state.angle_deg, state.speed_deg_s, a, step_s), speed)
            path.append(KeptStep(float(a), state))
        return path

    def _after(self, acceleration_deg_s2: float, step_s: float) -> State:
        location, angle_deg, speed_deg_s, _ = self.state
        angle = next_angle(angle_deg, speed_deg_s, acceleration_deg_s2, step_s)
        return State(location + 1, angle, next_speed(speed_deg_s, acceleration_deg_s2, step_s))

    def _followed(self, path: list[KeptStep]) -> list[KeptStep] | None:
        """Return the path with the arm's joints; None where the arm cannot follow all of it."""
        if self._arm is None:
            return path
        assert self._goals is not None
        assert self.state.joints is not None
        moving = [each for each in path if not each.halts]
        goals = self._goals(moving[0].end.location, moving[-1].end.location)
        angles = np.array([each.end.angle_deg for each in moving])
        joints = self._arm.follow(self.state.joints, goals, angles)
        if joints is None:
            return None
        rows = [*joints, joints[-1]][: len(path)]
        return [each._replace(end=each.end._replace(joints=row)) for each, row in zip(path, rows, strict=True)]

    def _go_on(self, why: Why) -> Step:
        """Take the first step of the kept motion."""
        start, (acceleration, end, halts) = self.state, self._kept.popleft()
        self.state = end
        self.revealed.forget_before(end.location)
        return Step(Kind.HALT if halts else Kind.SCAN, why, start, end, acceleration, self.revealed.last, self.kept)

    def _wait(self, why: Why) -> Step:
        return Step(Kind.WAIT, why, self.state, self.state, 0.0, self.revealed.last, ())

    def _angles_after_pause(self) -> list[float]:
        """Return the angles of the next location at which the table may rest, the best first, the shorter way round."""
        window, angle_deg = self.revealed.window(self.state.location), self.state.angle_deg
        costs = self._method.rest_costs(self.revealed.online, window, angle_deg)
        targets = np.argsort(costs, kind="stable") * 360.0 / len(costs)
        unwrapped = targets - 360.0 * np.round((targets - angle_deg) / 360.0)
        return [a for a in unwrapped.tolist() if may_rest(window.terms, 1, a, self._margin_deg)]

    def _arrive(self, location: int, angle_deg: float) -> FloatArray | None:
        if self._arm is None:
            return None
        assert self._goals is not None
        return self._arm.arrive(self._goals(location, location)[0], angle_deg, self.state.joints)


@kernel
def may_rest(terms: Terms, column: int, angle_deg: float, margin_deg: float) -> bool:
    """Return whether the table may stand at an angle of a column, with a margin from the forbidden region."""
    for angle in (angle_deg - margin_deg, angle_deg, angle_deg + margin_deg):
        if column_value(terms.values, terms.epsilon, column, angle) <= terms.epsilon:
            return False
    return True
