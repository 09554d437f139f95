"""Check whether the table can move from one scan location to the next without touching a forbidden region.

No sub-steps are needed. Strictly between two columns, all four samples around a point have a weight in the bilinear
look-up. So a step over the angles [lowest, highest] is allowed exactly if every sample of that range is allowed in
*both* columns. The range is from the sample at or below `lowest` to the one at or above `highest`.
"""

import numpy as np
import numpy.typing as npt

from planner.arrays import BoolArray, FloatArray
from planner.kernel import kernel
from planner.map.config_map import sample_at_or_above, sample_at_or_below, wrapped
from planner.table.motion import swept_angles

RunArray = npt.NDArray[np.int32]


@kernel
def free_runs(allowed: BoolArray) -> RunArray:
    """Count the consecutive samples, upward in angle and around the turn, that are allowed in a column and the next.

    Args:
        allowed: (n + 1, n_angles).

    Returns:
        (n, n_angles): entry (k, i) is the length of the run that starts at sample i of the step from column k to k + 1.
        It is 0 if i itself is forbidden, and the maximum int32 if the whole turn is allowed.
    """
    steps, count = allowed.shape[0] - 1, allowed.shape[1]
    runs = np.zeros((steps, count), dtype=np.int32)
    for k in range(steps):
        run = 0
        for i in range(2 * count - 1, -1, -1):
            run = run + 1 if allowed[k, i % count] and allowed[k + 1, i % count] else 0
            if i < count:
                runs[k, i] = run if run < count else np.iinfo(np.int32).max
    return runs


def free_runs_down(allowed: BoolArray) -> RunArray:
    """Count as `free_runs` does, but downward in angle."""
    return np.ascontiguousarray(free_runs(np.ascontiguousarray(allowed[:, ::-1]))[:, ::-1])


@kernel
def crossing_is_allowed(runs: RunArray, step: int, lowest_deg: float, highest_deg: float) -> bool:
    """Return whether the angles from `lowest_deg` to `highest_deg` are allowed during the whole step."""
    count = runs.shape[1]
    first = sample_at_or_below(lowest_deg * (count / 360.0))
    last = sample_at_or_above(highest_deg * (count / 360.0))
    return bool(runs[step, wrapped(first, count)] > last - first)


@kernel
def step_is_allowed(
    runs: RunArray, step: int, angle_deg: float, speed_deg_s: float, acceleration_deg_s2: float, step_s: float
) -> bool:
    """Return whether the table's motion from column `step` to the next is allowed, including both columns."""
    lowest, highest = swept_angles(angle_deg, speed_deg_s, acceleration_deg_s2, step_s)
    return crossing_is_allowed(runs, step, lowest, highest)


@kernel
def halt_is_allowed(
    values: FloatArray, epsilon: float, column: int, angle_deg: float, way_deg: float, margin_deg: float
) -> bool:
    """Return whether the table may pass an angle by a signed way and come back while the probe stays at a column.

    Args:
        values: (n + 1, n_angles) of the map.
        epsilon: maximum forbidden value.
        column: the column.
        angle_deg: where the table is to stand.
        way_deg: how far it goes beyond, signed.
        margin_deg: distance that is kept from what is forbidden.
    """
    count = values.shape[1]
    lowest, highest = min(angle_deg, angle_deg + way_deg) - margin_deg, max(angle_deg, angle_deg + way_deg) + margin_deg
    first, last = sample_at_or_below(lowest * (count / 360.0)), sample_at_or_above(highest * (count / 360.0))
    for sample in range(first, min(last, first + count) + 1):
        if values[column, wrapped(sample, count)] <= epsilon:
            return False
    return True
