import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from planner.cell.cell import Cell, placement
from planner.geometry.transforms import rigid_inverse
from planner.scanning.alignment import Calibration, aligned, probe_poses
from tests.planner.goals import goal_flange_poses

lengths = st.floats(-500.0, 500.0)
angles = st.floats(-720.0, 720.0)
poses = st.builds(placement, lengths, lengths, lengths, angles, angles, angles)


@settings(max_examples=50)
@given(table=poses, workpiece=poses, probe=poses, location=poses, theta_deg=angles)
def test_alignment_undoes_the_way_to_the_goal(
    table: np.ndarray, workpiece: np.ndarray, probe: np.ndarray, location: np.ndarray, theta_deg: float
) -> None:
    cell = Cell(T_BT=table, T_TW=workpiece, T_FS=probe)
    theta = np.array([theta_deg])
    goal = goal_flange_poses(cell, location[np.newaxis], theta)[0]
    assert np.abs(probe_poses(Calibration.of(cell), goal, theta)[0] - location).max() < 1e-9


def test_each_point_is_taken_by_the_pose_of_its_profile() -> None:
    rng = np.random.default_rng(0)
    T = np.stack([placement(*rng.uniform(-50, 50, 6)) for _ in range(3)])
    profiles, points = np.array([0, 2, 1, 2]), rng.normal(size=(4, 3))
    expected = [(T[k] @ np.append(point, 1.0))[:3] for k, point in zip(profiles, points, strict=True)]
    assert np.abs(aligned(T, profiles, points) - expected).max() < 1e-12


def test_a_turned_table_turns_the_cloud_back() -> None:
    cell = Cell()
    still = probe_poses(Calibration.of(cell), np.eye(4)[np.newaxis], np.array([0.0]))[0]
    turned = probe_poses(Calibration.of(cell), np.eye(4)[np.newaxis], np.array([90.0]))[0]
    # A fixed point beside a table that turns by +90 deg moves by -90 deg on it.
    point = (still @ rigid_inverse(still) @ (100.0, 0.0, 30.0, 1.0))[:3]
    assert np.abs((turned @ rigid_inverse(still) @ (*point, 1.0))[:3] - (0.0, -100.0, 30.0)).max() < 1e-9
