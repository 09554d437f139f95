"""Motions that come to rest within the columns in view and touch nothing forbidden: equal braking, or a halt.

They make tracking safe. A step is taken only if such a motion exists from its end. After one step of such a motion, the
rest of it is such a motion again. So the table can come to rest from every state that it reaches, whatever becomes
known later.
"""

import numpy as np

from planner.arrays import FloatArray, IndexArray
from planner.kernel import kernel
from planner.plans.crossing import crossing_is_allowed, halt_is_allowed
from planner.plans.problem import Terms
from planner.table.motion import next_angle, next_speed, swept_angles

NO_REST, HALT = -1, -2
"""No way to rest; and: the arm stays at the location, while the table passes its angle, brakes and comes back."""
# Additions leave this much of a speed that is zero, and of an acceleration that is the limit.
_STANDING_DEG_S = 1e-9
_ROUNDING = 1e-9


@kernel
def step_is_safe(
    terms: Terms, column: int, angle_deg: float, speed_deg_s: float, acceleration_deg_s2: float, margin_deg: float
) -> bool:
    """Return whether a step keeps the limits and stays a margin away from the forbidden region, all the way."""
    later = next_speed(speed_deg_s, acceleration_deg_s2, terms.step_s)
    if abs(later) > terms.speed_limit_deg_s + _ROUNDING:
        return False
    if abs(acceleration_deg_s2) > terms.acceleration_limit_deg_s2 * (1.0 + _ROUNDING):
        return False
    lowest, highest = swept_angles(angle_deg, speed_deg_s, acceleration_deg_s2, terms.step_s)
    return crossing_is_allowed(terms.runs, column, lowest - margin_deg, highest + margin_deg)


@kernel
def braking_steps(terms: Terms, column: int, last: int, angle_deg: float, speed_deg_s: float, margin_deg: float) -> int:
    """Return in how many steps of equal braking the table can come to rest; NO_REST where it cannot.

    Of several, one with about half of the maximum deceleration is taken, else the nearest harder one, else a gentler.

    Args:
        terms: the known columns.
        column: where the table is.
        last: the last known column.
        angle_deg: its angle.
        speed_deg_s: its speed.
        margin_deg: distance that is kept from forbidden samples' cells.
    """
    if abs(speed_deg_s) <= _STANDING_DEG_S:
        return 0
    least = int(np.ceil(abs(speed_deg_s) / (terms.acceleration_limit_deg_s2 * terms.step_s) - _ROUNDING))
    gentle = min(2 * least + 1, last - column)
    for steps in range(gentle, least - 1, -1):
        if _brakes_safely(terms, column, steps, angle_deg, speed_deg_s, margin_deg):
            return steps
    for steps in range(max(gentle, least - 1) + 1, last - column + 1):
        if _brakes_safely(terms, column, steps, angle_deg, speed_deg_s, margin_deg):
            return steps
    return NO_REST


@kernel
def _brakes_safely(
    terms: Terms, column: int, steps: int, angle_deg: float, speed_deg_s: float, margin_deg: float
) -> bool:
    acceleration = -speed_deg_s / (steps * terms.step_s)
    for k in range(column, column + steps):
        if not step_is_safe(terms, k, angle_deg, speed_deg_s, acceleration, margin_deg):
            return False
        angle_deg = next_angle(angle_deg, speed_deg_s, acceleration, terms.step_s)
        speed_deg_s = next_speed(speed_deg_s, acceleration, terms.step_s)
    return True


@kernel
def rests_after(
    terms: Terms, last: int, angle_deg: float, speed_deg_s: float, accelerations_deg_s2: FloatArray, margin_deg: float
) -> IndexArray:
    """Return (n,) how many steps of braking lead to rest after one step of each acceleration from column 0.

    HALT where braking along the path serves nowhere, but halting at the next location does. NO_REST where the step
    itself, or every way to rest after it, breaks a limit or meets what is forbidden.
    """
    rests = np.empty(len(accelerations_deg_s2), dtype=np.int64)
    for i in range(len(accelerations_deg_s2)):
        a = accelerations_deg_s2[i]
        rests[i] = NO_REST
        if step_is_safe(terms, 0, angle_deg, speed_deg_s, a, margin_deg):
            angle = next_angle(angle_deg, speed_deg_s, a, terms.step_s)
            speed = next_speed(speed_deg_s, a, terms.step_s)
            rests[i] = braking_steps(terms, 1, last, angle, speed, margin_deg)
            way_deg = 0.5 * speed * abs(speed) / terms.acceleration_limit_deg_s2
            least = np.ceil(abs(speed) / (terms.acceleration_limit_deg_s2 * terms.step_s) - _ROUNDING)
            # Towards the end of the view the table brakes along the path, not at its limit.
            if (
                rests[i] == NO_REST
                and least <= last - 1
                and halt_is_allowed(terms.values, terms.epsilon, 1, angle, way_deg, margin_deg)
            ):
                rests[i] = HALT
    return rests
