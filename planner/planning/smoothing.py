"""Post-processing that removes acceleration peaks from a plan without new risks or costs.

A plan is changed by waves (+d, -2d, +d) on the accelerations of three neighboring blocks of steps. Under Eq. (3) and
(4), such a wave ends with the former angle and speed, so the motion before and after it does not change. A wave is
accepted only if

- the maximum acceleration under it decreases, or stays while the sum of fourth powers decreases (lower peaks),
- Eq. (7) does not increase,
- the limits hold and each step under it stays allowed.
"""

from dataclasses import replace

import numpy as np

from planner.arrays import BoolArray, FloatArray, IndexArray
from planner.kernel import kernel
from planner.map.config_map import column_value
from planner.plans.crossing import step_is_allowed
from planner.plans.plan import Plan, make_plan
from planner.plans.problem import Problem, Terms
from planner.table.cost import acceleration_cost, speed_cost, value_cost
from planner.table.motion import next_angle, next_speed, roll_out

# Lengths of a wave's blocks in steps: short ones reduce peaks, long ones shift curves.
BLOCK_LENGTHS = (1, 2, 3, 5, 8)
SWEEPS = 60


def smooth(problem: Problem, plan: Plan) -> Plan:
    """Return the plan with lower acceleration peaks, never in a forbidden region and never at a higher cost."""
    fixed = np.zeros(problem.step_count, dtype=np.bool_)
    fixed[[pause.step for pause in plan.pauses]] = True
    accelerations, angles, speeds = (
        plan.accelerations_deg_s2.copy(),
        plan.angles_deg.copy(),
        plan.speeds_deg_s.copy(),
    )
    blocks = np.array(BLOCK_LENGTHS, dtype=np.int64)
    for _ in range(SWEEPS):
        if _sweep(problem.terms, fixed, blocks, angles, speeds, accelerations) == 0:
            break
    if not plan.pauses:
        angles, speeds = roll_out(float(angles[0]), float(speeds[0]), accelerations, problem.step_s)
    smoother = make_plan(problem, f"{plan.planner}+smoothing", angles, speeds, accelerations, plan.pauses)
    return smoother if smoother.cost.total <= plan.cost.total else replace(plan, planner=smoother.planner)


@kernel
def _sweep(
    terms: Terms,
    fixed: BoolArray,
    blocks: IndexArray,
    angles: FloatArray,
    speeds: FloatArray,
    accelerations: FloatArray,
) -> int:
    """Try one wave of each length at each place. Change the motion in place and return the number of accepted waves."""
    accepted = 0
    for length in blocks:
        for first in range(len(accelerations) - 3 * length + 1):
            last = first + 3 * length
            if fixed[first:last].any():
                continue
            size = _flattening(accelerations[first:last], length)
            for _ in range(3):
                if abs(size) < 1e-6 * terms.acceleration_limit_deg_s2:
                    break
                if _try_wave(terms, first, length, size, angles, speeds, accelerations):
                    accepted += 1
                    break
                size *= 0.4
    return accepted


@kernel
def _flattening(accelerations: FloatArray, length: int) -> float:
    """Return the size of the wave with the minimum sum of squares."""
    first = accelerations[:length].sum()
    middle = accelerations[length : 2 * length].sum()
    last = accelerations[2 * length :].sum()
    return float(-(first - 2.0 * middle + last) / (6.0 * length))


@kernel
def _try_wave(
    terms: Terms,
    first: int,
    length: int,
    size: float,
    angles: FloatArray,
    speeds: FloatArray,
    accelerations: FloatArray,
) -> bool:
    """Apply the wave if it is an improvement."""
    count = 3 * length
    old = accelerations[first : first + count]
    new = old.copy()
    new[:length] += size
    new[length : 2 * length] -= 2.0 * size
    new[2 * length :] += size
    old_peak, new_peak = np.abs(old).max(), np.abs(new).max()
    if new_peak > old_peak or (new**4).sum() >= (old**4).sum():
        return False
    new_angles, new_speeds = np.empty(count + 1), np.empty(count + 1)
    new_angles[0], new_speeds[0] = angles[first], speeds[first]
    change = 0.0
    for i in range(count):
        k = first + i
        if not step_is_allowed(terms.runs, k, new_angles[i], new_speeds[i], new[i], terms.step_s):
            return False
        new_angles[i + 1] = next_angle(new_angles[i], new_speeds[i], new[i], terms.step_s)
        new_speeds[i + 1] = next_speed(new_speeds[i], new[i], terms.step_s)
        if abs(new_speeds[i + 1]) > terms.speed_limit_deg_s:
            return False
        change += _cost(terms, k, new_angles[i + 1], new_speeds[i + 1], new[i])
        change -= _cost(terms, k, angles[k + 1], speeds[k + 1], old[i])
    if change > 0.0:
        return False
    angles[first + 1 : first + count] = new_angles[1:count]
    speeds[first + 1 : first + count] = new_speeds[1:count]
    accelerations[first : first + count] = new
    return True


@kernel
def _cost(terms: Terms, step: int, angle_deg: float, speed_deg_s: float, acceleration_deg_s2: float) -> float:
    return (
        acceleration_cost(terms.acceleration_weight, acceleration_deg_s2)
        + speed_cost(terms.speed_weight, speed_deg_s)
        + value_cost(column_value(terms.values, terms.epsilon, step + 1, angle_deg))
    )
