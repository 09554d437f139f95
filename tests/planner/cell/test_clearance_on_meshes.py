"""The thinned form of `python -m tests.planner.clearance_sweep`."""

from collections.abc import Callable

import numpy as np
import pytest
import trimesh

from planner.kinematics.configuration import Configuration
from planner.kinematics.inverse_kinematics import inverse_kinematics
from planner.map.map_builder import build_maps
from planner.map.map_problem import map_problem
from tests.planner.clearance_sweep import MESHES, coal_clearance, coal_mesh, compared, with_mesh
from tests.planner.goals import goal_flange_poses

POSES, TRIANGLES = 40, 2000


@pytest.mark.parametrize("make", MESHES)
def test_a_clearance_is_never_above_the_one_that_coal_finds_and_little_below(
    make: Callable[[int], trimesh.Trimesh],
) -> None:
    found = compared(with_mesh(make(TRIANGLES)), POSES)
    assert 20 < np.sum(found.true_mm > 0.0) < POSES
    assert found.above_mm <= 1e-3
    assert found.below_mm <= 2.0 * found.spacing_mm + 3.0


@pytest.mark.parametrize("make", MESHES)
def test_no_allowed_cell_of_a_map_collides_with_the_mesh(make: Callable[[int], trimesh.Trimesh]) -> None:
    scan = with_mesh(make(TRIANGLES))
    problem, n_angles, surface = map_problem(scan), 24, coal_mesh(scan.mesh)
    maps = build_maps(problem, list(Configuration), n_angles)
    angles_deg = np.linspace(0.0, 360.0, n_angles, endpoint=False)
    goals = goal_flange_poses(scan.cell, problem.T_WS, angles_deg)
    rng, least_mm, checked = np.random.default_rng(2), np.inf, 0
    for configuration, each in maps.items():
        for location, angle in rng.permutation(np.argwhere(each.allowed))[:8]:
            joints, _ = inverse_kinematics(scan.cell.arm, goals[location, [angle]])
            T_BW = scan.cell.table_factors(angles_deg[[angle]])[0] @ scan.cell.T_TW
            least_mm = min(least_mm, coal_clearance(scan.mesh, surface, T_BW, joints[0, configuration]))
            checked += 1
    assert checked > 20
    assert least_mm >= scan.value.minimum_clearance_mm
