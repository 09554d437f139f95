"""Tracking in simulated time, on maps that are revealed a column at a time, and judged by look-ups in the map alone."""

from collections.abc import Callable, Sequence

import numpy as np

from planner.arrays import FloatArray
from planner.map.config_map import ConfigurationMap, map_value
from planner.table.motion import Limits
from planner.tracking.decision import Method, Receding, costs_of_starts
from planner.tracking.followed_arm import FollowedArm
from planner.tracking.online_planner import Blocked, Kind, OnlinePlanner, State, Step, may_rest
from planner.tracking.revealed_map import RevealedMap
from protocol.trapezoid import MotionCommand, ReferenceState, advance, time_to_rest_s

STEP_S = 0.25
MARGIN_DEG = 0.1
SUB_STEPS = 16


def begun(
    map_: ConfigurationMap,
    view: int,
    method: Method | None = None,
    limits: Limits | None = None,
    resume: int = 3,
    arm: FollowedArm | None = None,
) -> OnlinePlanner | None:
    """Return a planner whose table rests at the first location, with only that known; None where it cannot rest."""
    revealed = RevealedMap(map_.angle_count, STEP_S, limits or Limits(), None, view)
    revealed.reveal(map_.values[0])
    window = revealed.window(0)
    order = np.argsort(costs_of_starts(revealed.online, window), kind="stable") * 360.0 / map_.angle_count
    starts = [angle for angle in order.tolist() if may_rest(window.terms, 0, angle, MARGIN_DEG)]
    if not starts:
        return None
    start = State(0, starts[0], 0.0, None if arm is None else np.zeros(6))
    goals = None if arm is None else no_goals
    return OnlinePlanner(revealed, method or Receding(), start, MARGIN_DEG, min(resume, view), arm, goals)


def no_goals(first: int, last: int) -> FloatArray:
    """Return goals for an arm that needs none."""
    return np.tile(np.eye(4), (last - first + 1, 1, 1))


def tracked(
    planner: OnlinePlanner,
    map_: ConfigurationMap,
    revealed_at: Callable[[int], int],
    may_decide: Callable[[int], bool] = lambda _: True,
    ticks: int = 2000,
) -> tuple[list[Step], Blocked | None]:
    """Step through a map; `revealed_at` gives the number of locations that are known at a tick of the clock."""
    steps: list[Step] = []
    for tick in range(ticks):
        while planner.revealed.room > 0 and planner.revealed.count < min(revealed_at(tick), map_.location_count):
            planner.revealed.reveal(map_.values[planner.revealed.count])
        planner.ended = planner.revealed.count == map_.location_count
        if planner.is_finished:
            break
        step = planner.step(may_decide(tick))
        if isinstance(step, Blocked):
            return steps, step
        steps.append(step)
    return steps, None


def faults(map_: ConfigurationMap, step: Step, limits: Limits | None = None) -> list[str]:
    """Return what is wrong with a step and the motion to rest that was kept after it, by look-ups between columns."""
    limits = limits or Limits()
    if step.kind is Kind.HALT:
        return _faults_of_halt(map_, step.start, limits)
    if step.kind is not Kind.SCAN:
        is_free = _is_free(map_, step.end.location, [step.end.angle_deg + d for d in (-MARGIN_DEG, 0.0, MARGIN_DEG)])
        return [] if is_free and step.end.is_at_rest else [f"no rest at {step.end}"]
    found: list[str] = []
    state = step.start
    for acceleration, end, halts in ((step.acceleration_deg_s2, step.end, False), *step.kept):
        if halts:
            found += _faults_of_halt(map_, state, limits)
            state = end
            continue
        if end.location > step.last_known:
            found.append(f"a step to location {end.location}, and {step.last_known} is the last known")
        found += _faults_of_motion(map_, state, acceleration, end, limits)
        state = end
    if not state.is_at_rest:
        found.append(f"the kept motion ends at {state.speed_deg_s} deg/s")
    return found


def _faults_of_motion(
    map_: ConfigurationMap, state: State, acceleration_deg_s2: float, end: State, limits: Limits
) -> list[str]:
    """Return what is wrong with one step of constant acceleration."""
    found, times = [], np.linspace(0.0, STEP_S, SUB_STEPS + 1)
    angles = state.angle_deg + state.speed_deg_s * times + 0.5 * acceleration_deg_s2 * times**2
    speed_error = state.speed_deg_s + acceleration_deg_s2 * STEP_S - end.speed_deg_s
    if abs(angles[-1] - end.angle_deg) + abs(speed_error) > 1e-6:
        found.append(f"Eq. (3), (4) do not lead from {state} to {end}")
    if max(abs(acceleration_deg_s2) - limits.acceleration_deg_s2, abs(end.speed_deg_s) - limits.speed_deg_s) > 1e-6:
        found.append(f"a limit is exceeded on the way to {end}")
    for share, angle in zip(times / STEP_S, angles.tolist(), strict=True):
        if not _is_free(map_, state.location + float(share), [angle - MARGIN_DEG, angle, angle + MARGIN_DEG]):
            return [*found, f"{angle:.2f} deg between {state.location} and {end.location} is forbidden"]
    return found


def _faults_of_halt(map_: ConfigurationMap, start: State, limits: Limits) -> list[str]:
    """Return what is wrong with coming to rest at the angle where the table is, by the controller's own rules."""
    command = MotionCommand(start.angle_deg, *limits)
    reference = ReferenceState(start.angle_deg, start.speed_deg_s)
    for time_s in np.linspace(0.0, time_to_rest_s(reference, command), 4 * SUB_STEPS):
        angle = advance(reference, command, float(time_s)).angle_deg
        if not _is_free(map_, start.location, [angle - MARGIN_DEG, angle, angle + MARGIN_DEG]):
            return [f"{angle:.2f} deg is forbidden during the halt at {start.location}"]
    return []


def _is_free(map_: ConfigurationMap, location: float, angles_deg: Sequence[float]) -> bool:
    return all(map_value(map_.values, map_.epsilon, location, angle) > map_.epsilon for angle in angles_deg)
