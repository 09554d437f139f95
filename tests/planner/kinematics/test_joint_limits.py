from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from planner.arrays import FloatArray
from planner.kinematics.arm import Arm
from planner.kinematics.joint_limits import FaultKind, JointFault, first_joint_fault

VIPER = Arm.load()
HOME_DEG = np.array([10.0, -60.0, 150.0, 20.0, 40.0, 30.0])


def path(joint: int, angles_deg: Sequence[float]) -> FloatArray:
    """Return joints at home except for one, counted from 1."""
    joints_deg = np.tile(HOME_DEG, (len(angles_deg), 1))
    joints_deg[:, joint - 1] = angles_deg
    return joints_deg


@given(joint=st.integers(1, 6), share=st.floats(0.0, 1.0), data=st.data())
def test_every_joint_is_held_to_both_of_its_limits(joint: int, share: float, data: st.DataObject) -> None:
    lower, upper = VIPER.lower_deg[joint - 1], VIPER.upper_deg[joint - 1]
    inside = lower + share * (upper - lower)
    assert first_joint_fault(VIPER, path(joint, [inside] * 3), 1.0) is None
    beyond = data.draw(st.sampled_from([(lower, -1.0), (upper, 1.0)]))
    off = beyond[0] + beyond[1] * data.draw(st.floats(1e-5, 1e4))
    place = data.draw(st.integers(0, 2))
    angles = [inside] * 3
    angles[place] = off
    fault = first_joint_fault(VIPER, path(joint, angles), 1e6)
    assert fault is not None
    assert fault.location <= place
    if fault.kind is FaultKind.LIMIT:
        assert fault == JointFault(place, joint, FaultKind.LIMIT, off, beyond[0])


@pytest.mark.parametrize("joint", range(1, 7))
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_every_joint_is_held_to_its_speed_either_way(joint: int, sign: float) -> None:
    top = VIPER.max_speed_deg_s[joint - 1]
    angle = HOME_DEG[joint - 1]
    step_s = 0.05
    for factor, is_fault in ((0.999, False), (1.001, True)):
        angles = [angle, angle, angle + sign * factor * top * step_s]
        fault = first_joint_fault(VIPER, path(joint, angles), step_s)
        assert (fault is not None) == is_fault
    assert fault is not None
    assert (fault.location, fault.joint, fault.kind, fault.limit) == (2, joint, FaultKind.SPEED, top)
    assert fault.value == pytest.approx(sign * 1.001 * top)


def test_a_turn_that_is_not_carried_along_is_a_fault_though_the_joint_is_fast_enough() -> None:
    fault = first_joint_fault(VIPER, path(6, [170.0, -170.0]), 1.0)
    assert str(fault) == ("at location 1 joint 6 moves by -340.0 deg from the previous location, more than half a turn")
    assert first_joint_fault(VIPER, path(6, [170.0, 190.0]), 1.0) is None


def test_in_a_pause_the_arm_may_take_another_turn_but_no_limit_is_lifted() -> None:
    assert first_joint_fault(VIPER, path(6, [0.0, 300.0, -300.0]), 1.0, [1]) == JointFault(
        1, 6, FaultKind.TURN, 300.0, 180.0
    )
    assert first_joint_fault(VIPER, path(6, [200.0, 300.0, -300.0]), 1.0, [1]) is None
    beyond = first_joint_fault(VIPER, path(6, [200.0, 300.0, -361.0]), 1.0, [1])
    assert beyond == JointFault(2, 6, FaultKind.LIMIT, -361.0, -360.0)


def test_a_joint_without_an_angle_is_a_fault() -> None:
    fault = first_joint_fault(VIPER, path(3, [150.0, float("nan"), 150.0]), 1.0)
    assert str(fault) == "at location 1 joint 3 has no angle"


def test_the_first_location_counts_whatever_is_wrong_there() -> None:
    joints_deg = path(6, [0.0, 0.0, 170.0, 0.0, 400.0])
    fault = first_joint_fault(VIPER, joints_deg, 0.2)
    assert fault is not None
    assert (fault.location, fault.kind) == (2, FaultKind.SPEED)


def test_the_limits_are_those_of_the_arm_that_is_asked_about() -> None:
    narrow = replace(VIPER, upper_deg=(170.0, 45.0, 256.0, 19.0, 120.0, 360.0))
    assert str(first_joint_fault(narrow, path(4, [20.0]), 1.0)) == (
        "at location 0 joint 4 is at 20.0 deg, beyond its limit of 19 deg"
    )


def test_the_rounding_of_a_file_is_no_fault() -> None:
    assert first_joint_fault(VIPER, path(6, [360.0 + 1e-9, 300.0]), 0.1) is None
