"""Arms whose joints are simple functions of location and table angle, and a slow, obvious check of their turns."""

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy.spatial.transform import Rotation

from planner.arrays import CodeArray, FloatArray, IndexArray
from planner.kinematics.arm import Arm
from planner.plans.arm_on_path import ArmOnPath
from planner.plans.problem import Problem
from planner.search.joint_turns import Margin
from tests.planner.exhaustive_search import cost_of, motion

VIPER = Arm.load()


def winding_arm(
    twist_deg: float,
    range_6_deg: float = 360.0,
    speed_6_deg_s: float = 600.0,
    range_4_deg: float = 190.0,
    sway_deg: float = 0.0,
    turns_4: int = 0,
    zero_deg: float = 0.0,
) -> ArmOnPath:
    """Return an arm whose joint 6 follows the table and turns by `twist_deg` per location; joint 4 moves too.

    Joint 6 is at 0 where table angle and twist add up to `zero_deg`.
    """
    arm = replace(
        VIPER,
        lower_deg=(*VIPER.lower_deg[:3], -range_4_deg, VIPER.lower_deg[4], -range_6_deg),
        upper_deg=(*VIPER.upper_deg[:3], range_4_deg, VIPER.upper_deg[4], range_6_deg),
        max_speed_deg_s=(*VIPER.max_speed_deg_s[:5], speed_6_deg_s),
    )

    def solve(locations: IndexArray, angles_deg: FloatArray) -> tuple[FloatArray, CodeArray]:
        joints_deg = np.tile([0.0, -60.0, 150.0, 0.0, 40.0, 0.0], (len(angles_deg), 1))
        joints_deg[:, 3] = turns_4 * angles_deg + sway_deg * np.sin(np.radians(angles_deg + 31.0 * locations))
        joints_deg[:, 5] = angles_deg + twist_deg * locations - zero_deg
        joints_deg[:, 3:] -= 360.0 * np.rint(joints_deg[:, 3:] / 360.0)
        return np.radians(joints_deg), np.zeros(len(angles_deg), dtype=np.uint8)

    return ArmOnPath(arm, solve)


def turns_after(
    on_path: ArmOnPath,
    location: int,
    angle_deg: float,
    before_deg: list[list[float]] | None,
    step_s: float,
    margin: Margin,
) -> list[list[float]]:
    """Return the angles that each joint may have at a location, on whatever turn, after those of the location before.

    A joint goes the shorter way round, and so has the flange to; where a list is empty the arm cannot follow.
    """
    joints, _ = on_path.solve(np.array([location]), np.array([angle_deg]))
    arm, result = on_path.arm, []
    for j, principal in enumerate(np.degrees(joints[0]).tolist()):
        turns = [principal + 360.0 * n for n in range(-4, 5)]
        if before_deg is None:
            reached = turns
        else:
            nearest = [(min(turns, key=lambda each: abs(each - before)), before) for before in before_deg[j]]
            most_deg = arm.max_speed_deg_s[j] * margin.speed_share * step_s
            reached = [now for now, before in nearest if abs(now - before) <= most_deg]
        lower_deg, upper_deg = arm.lower_deg[j] + margin.limit_deg, arm.upper_deg[j] - margin.limit_deg
        result.append([angle for angle in reached if lower_deg <= angle <= upper_deg])
    if before_deg is not None and all(before_deg) and all(result):
        wrist_deg = np.array([[each[j][0] for j in (3, 4, 5)] for each in (before_deg, result)])
        wrist_deg[1] -= 360.0 * np.rint((wrist_deg[1] - wrist_deg[0]) / 360.0)
        if flange_spins(wrist_deg):
            result = [[] for _ in result]
    return result


def flange_spins(wrist_deg: FloatArray) -> bool:
    """Return whether a wrist that moves proportionally between two joints (3,) rotates the flange the long way."""
    shares = np.linspace(0.0, 1.0, 200)[:, np.newaxis]
    quaternions = Rotation.from_euler(
        "ZYZ", wrist_deg[0] + shares * (wrist_deg[1] - wrist_deg[0]), degrees=True
    ).as_quat()
    # A rotation has two quaternions; take those that make a continuous way, and see on which side of the first it ends.
    sense = np.cumprod(np.sign(np.sum(quaternions[1:] * quaternions[:-1], axis=1)))[-1]
    return bool(sense * np.dot(quaternions[0], quaternions[-1]) < 0.0)


def least_cost_followed(
    problem: Problem, on_path: ArmOnPath, accelerations: Sequence[float], margin: Margin
) -> tuple[float, int]:
    """Try every sequence of the given accelerations.

    Returns:
        The cost of the best that the arm can follow, infinite where there is none; and the first location that none
        reaches, or their number.
    """
    best, unreached = math.inf, 0

    def go_on(states: list[tuple[float, float]], used: list[float], joints_deg: list[list[float]] | None) -> None:
        nonlocal best, unreached
        location = len(used)
        joints_deg = turns_after(on_path, location, states[-1][0], joints_deg, problem.step_s, margin)
        cost = cost_of(problem, states, used)
        if not all(joints_deg) or math.isinf(cost):
            return
        unreached = max(unreached, location + 1)
        if location == problem.step_count:
            best = min(best, cost)
            return
        for acceleration in accelerations:
            go_on([*states, motion(states[-1], [acceleration], problem.step_s)[1]], [*used, acceleration], joints_deg)

    go_on([(float(problem.start_angle_deg or 0.0), 0.0)], [], None)
    return best, unreached
