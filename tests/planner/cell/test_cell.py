import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from planner.cell.cell import Cell, placement
from planner.errors import PoseError
from planner.geometry.transforms import rotations_z
from tests.planner.goals import goal_flange_poses

CELL = Cell(T_TW=placement(10.0, -20.0, 30.0, 15.0, 0.0, 0.0), T_FS=placement(5.0, 0.0, 100.0, 0.0, 30.0, 0.0))
LOCATIONS = np.stack([placement(80.0, 0.0, 90.0, 10.0, 120.0, 30.0), placement(0.0, 0.0, 300.0, 0.0, 180.0, 0.0)])


def test_at_each_goal_the_probe_stands_at_its_location_on_the_turned_workpiece() -> None:
    angles_deg = np.array([0.0, 37.0, 400.0])
    goals = goal_flange_poses(CELL, LOCATIONS, angles_deg)
    assert goals.shape == (2, 3, 4, 4)
    for n, location in enumerate(LOCATIONS):
        for m, angle_deg in enumerate(angles_deg):
            T_BW = CELL.T_BT @ rotations_z(np.array([angle_deg]))[0] @ CELL.T_TW
            np.testing.assert_allclose(goals[n, m] @ CELL.T_FS, T_BW @ location, atol=1e-9)


@settings(max_examples=25)
@given(shift_deg=st.floats(-360.0, 360.0), angle_deg=st.floats(-720.0, 720.0))
def test_turning_the_workpiece_on_the_table_shifts_the_goals_by_that_angle(shift_deg: float, angle_deg: float) -> None:
    turned = Cell(T_TW=rotations_z(np.array([shift_deg]))[0] @ CELL.T_TW, T_FS=CELL.T_FS)
    np.testing.assert_allclose(
        goal_flange_poses(turned, LOCATIONS, np.array([angle_deg])),
        goal_flange_poses(CELL, LOCATIONS, np.array([angle_deg + shift_deg])),
        atol=1e-9,
    )


def test_a_goal_is_the_product_of_its_two_factors() -> None:
    angles_deg = np.array([0.0, 90.0])
    left, right = CELL.table_factors(angles_deg), CELL.location_factors(LOCATIONS)
    np.testing.assert_array_equal(goal_flange_poses(CELL, LOCATIONS, angles_deg)[1, 1], left[1] @ right[1])


def test_a_placement_that_is_not_rigid_is_refused_by_its_name() -> None:
    with pytest.raises(PoseError, match="T_TW is not rigid"):
        Cell(T_TW=np.diag([1.0, 1.0, 2.0, 1.0]))
