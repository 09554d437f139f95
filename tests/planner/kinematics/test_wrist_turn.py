import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from planner.kinematics.wrist_turn import turns_the_long_way
from tests.planner.winding_arm import flange_spins

ANGLES, MOVES = st.floats(1.0, 119.0), st.floats(-179.0, 179.0)


@given(before_5=ANGLES, after_5=ANGLES, sense=st.sampled_from([-1.0, 1.0]), move_4=MOVES, move_6=MOVES)
def test_the_way_round_is_that_of_many_small_rotations(
    before_5: float, after_5: float, sense: float, move_4: float, move_6: float
) -> None:
    before, after = np.array([20.0, sense * before_5, -70.0]), np.array([20.0 + move_4, sense * after_5, move_6 - 70.0])
    told = turns_the_long_way(*np.radians([sense * before_5, sense * after_5, move_4, move_6]).tolist())
    assert told == flange_spins(np.array([before, after]))


@pytest.mark.parametrize("move_6", [-175.0, -90.0, 0.0, 90.0, 175.0])
def test_joint_6_alone_never_goes_the_long_way(move_6: float) -> None:
    assert not turns_the_long_way(0.7, 0.7, 0.0, float(np.radians(move_6)))


def test_near_the_singularity_joints_4_and_6_may_swing_against_each_other_but_not_together() -> None:
    swing = float(np.radians(165.0))
    assert not turns_the_long_way(0.1, 0.1, swing, -swing)
    assert turns_the_long_way(0.1, 0.1, swing, swing)
