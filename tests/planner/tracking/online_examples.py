"""Tracking in simulated time, on maps that are revealed a column at a time, and judged by look-ups in the map alone."""

from collections.abc import Callable, Sequence

import numpy as np

from planner.map.config_map import ConfigurationMap, map_value
from planner.table.motion import Limits
from planner.tracking.decision import Method, Receding, costs_of_starts
from planner.tracking.online_planner import Blocked, Kind, OnlinePlanner, State, Step, may_rest
from planner.tracking.revealed_map import RevealedMap

STEP_S = 0.25
MARGIN_DEG = 0.1
SUB_STEPS = 16


def begun(
    map_: ConfigurationMap, view: int, method: Method | None = None, limits: Limits | None = None, resume: int = 3
) -> OnlinePlanner | None:
    """Return a planner whose table rests at the first location, with only that known; None where it cannot rest."""
    revealed = RevealedMap(map_.angle_count, STEP_S, limits or Limits(), None, view)
    revealed.reveal(map_.values[0])
    window = revealed.window(0)
    order = np.argsort(costs_of_starts(revealed.online, window), kind="stable") * 360.0 / map_.angle_count
    starts = [angle for angle in order.tolist() if may_rest(window.terms, 0, angle, MARGIN_DEG)]
    if not starts:
        return None
    start = State(0, starts[0], 0.0)
    return OnlinePlanner(revealed, method or Receding(), start, MARGIN_DEG, min(resume, view))


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
    if step.kind is not Kind.SCAN:
        is_free = _is_free(map_, step.end.location, [step.end.angle_deg + d for d in (-MARGIN_DEG, 0.0, MARGIN_DEG)])
        return [] if is_free and step.end.is_at_rest else [f"no rest at {step.end}"]
    found, state = [], step.start
    for acceleration, end in ((step.acceleration_deg_s2, step.end), *step.kept):
        if end.location > step.last_known:
            found.append(f"a step to location {end.location}, and {step.last_known} is the last known")
        times = np.linspace(0.0, STEP_S, SUB_STEPS + 1)
        angles = state.angle_deg + state.speed_deg_s * times + 0.5 * acceleration * times**2
        if abs(angles[-1] - end.angle_deg) + abs(state.speed_deg_s + acceleration * STEP_S - end.speed_deg_s) > 1e-6:
            found.append(f"Eq. (3), (4) do not lead from {state} to {end}")
        if abs(acceleration) > limits.acceleration_deg_s2 + 1e-6 or abs(end.speed_deg_s) > limits.speed_deg_s + 1e-6:
            found.append(f"a limit is exceeded on the way to {end}")
        for share, angle in zip(times / STEP_S, angles, strict=True):
            around = [angle + d for d in (-MARGIN_DEG, 0.0, MARGIN_DEG)]
            if not _is_free(map_, state.location + float(share), around):
                found.append(f"{angle:.2f} deg between {state.location} and {end.location} is forbidden")
                break
        state = end
    if not state.is_at_rest:
        found.append(f"the kept motion ends at {state.speed_deg_s} deg/s")
    return found


def _is_free(map_: ConfigurationMap, location: float, angles_deg: Sequence[float]) -> bool:
    return all(map_value(map_.values, map_.epsilon, location, angle) > map_.epsilon for angle in angles_deg)
