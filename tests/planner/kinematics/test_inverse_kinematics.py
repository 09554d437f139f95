"""The closed form compared with py-opw-kinematics, and with our own forward kinematics."""

from dataclasses import replace

import numpy as np
import numpy.typing as npt
import pytest
from py_opw_kinematics import KinematicModel, Robot
from scipy.spatial.transform import Rotation

from planner.arrays import FloatArray
from planner.kinematics.arm import Arm
from planner.kinematics.configuration import Configuration
from planner.kinematics.inverse_kinematics import inverse_kinematics
from planner.kinematics.joint_configurations import configurations
from planner.reasons import Reason

VIPER = Arm.load()
# Table of the Puma 560 in mm: mirrored twists, an offset shoulder, another wrist.
PUMA = Arm(
    name="Puma 560",
    d_mm=(672.0, 0.0, 150.05, 431.8, 0.0, 56.0),
    a_mm=(0.0, 431.8, 20.3, 0.0, 0.0, 0.0),
    alpha_deg=(90.0, 0.0, -90.0, 90.0, -90.0, 0.0),
    lower_deg=(-160.0, -45.0, -225.0, -110.0, -100.0, -266.0),
    upper_deg=(160.0, 225.0, 45.0, 170.0, 100.0, 266.0),
    max_speed_deg_s=(100.0,) * 6,
)
# Which of the oracle's branches (4 wrist + 2 shoulder + elbow, signs taken on its own angles) each slot is.
VIPER_BRANCHES = [4, 0, 5, 1, 7, 3, 6, 2]
PUMA_BRANCHES = [0, 4, 1, 5, 3, 7, 2, 6]


def oracle(arm: Arm) -> Robot:
    """Return the ortho-parallel model of the arm, whose zero pose has upper arm and forearm upright."""
    mirrored = arm.alpha_deg[0] > 0
    model = KinematicModel(
        a1=arm.a_mm[0],
        a2=arm.a_mm[2],
        b=(arm.d_mm[1] + arm.d_mm[2]) * (-1 if mirrored else 1),
        c1=arm.d_mm[0],
        c2=arm.a_mm[1],
        c3=arm.d_mm[3],
        c4=arm.d_mm[5],
        offsets=(0, -np.pi / 2, np.pi / 2, 0, 0, 0),
        flip_axes=(False, mirrored, mirrored, False, mirrored, False),
    )
    return Robot(model, degrees=False)


def random_joints(arm: Arm, count: int, seed: int) -> FloatArray:
    lower, upper = np.radians(arm.lower_deg), np.radians(arm.upper_deg)
    return np.random.default_rng(seed).uniform(lower, upper, (count, 6))


def angle_between(a: FloatArray, b: FloatArray) -> FloatArray:
    turns = (a - b) / (2.0 * np.pi)
    return np.asarray(np.abs(turns - np.rint(turns)) * 2.0 * np.pi)


def away_from_singularities(arm: Arm, joints: FloatArray) -> npt.NDArray[np.bool_]:
    """True for joints whose wrist, elbow and shoulder are each a little away from the place where solutions meet."""
    wrist_center = arm.link_frames(joints)[:, 4, :3, 3]
    sense = -np.sign(arm.alpha_deg[0])
    elbow = sense * joints[:, 2] - np.arctan2(arm.d_mm[3], arm.a_mm[2])
    off_axis_1 = np.hypot(wrist_center[:, 0], wrist_center[:, 1]) - abs(arm.d_mm[1] + arm.d_mm[2])
    sines = np.abs(np.sin([joints[:, 4], elbow]))
    return np.asarray((sines > 1e-4).all(axis=0) & (off_axis_1 > 0.1))


@pytest.mark.parametrize(
    ("arm", "branches", "count"),
    [(VIPER, VIPER_BRANCHES, 100_000), (PUMA, PUMA_BRANCHES, 10_000)],
    ids=["viper", "puma"],
)
def test_branches_joints_and_flags_are_those_of_the_oracle(arm: Arm, branches: list[int], count: int) -> None:
    given = random_joints(arm, count, seed=3)
    poses = oracle(arm).batch_forward(given)
    np.testing.assert_allclose(arm.flange_poses(given), poses.as_matrix(), atol=1e-9)
    joints, reasons = inverse_kinematics(arm, poses.as_matrix())
    expected = oracle(arm).reach(poses).joints[:, branches]

    exists = reasons != Reason.OUT_OF_REACH
    regular = away_from_singularities(arm, given)
    assert regular.mean() > 0.99
    np.testing.assert_array_equal(exists[regular], ~np.isnan(expected[regular]).any(axis=2))
    compared = exists & regular[:, np.newaxis]
    assert angle_between(joints[compared], expected[compared]).max() < 1e-9
    slots = np.broadcast_to(np.arange(8), exists.shape)
    np.testing.assert_array_equal(configurations(arm, joints[compared]), slots[compared])


@pytest.mark.parametrize("arm", [VIPER, PUMA], ids=["viper", "puma"])
def test_every_solution_given_holds_its_pose(arm: Arm) -> None:
    poses = arm.flange_poses(random_joints(arm, 20_000, seed=4))
    joints, reasons = inverse_kinematics(arm, poses)
    given = reasons != Reason.OUT_OF_REACH
    wanted = np.broadcast_to(poses[:, np.newaxis], (*given.shape, 4, 4))[given]
    assert np.abs(arm.flange_poses(joints[given]) - wanted).max() < 1e-9


def test_the_joints_that_made_a_pose_are_found_again_in_their_slot() -> None:
    given = random_joints(VIPER, 20_000, seed=5)
    joints, reasons = inverse_kinematics(VIPER, VIPER.flange_poses(given))
    rows, slots = np.arange(len(given)), configurations(VIPER, given)
    regular = away_from_singularities(VIPER, given)
    assert (reasons[rows, slots][regular] == Reason.REACHED).all()
    assert angle_between(joints[rows, slots], given)[regular].max() < 1e-9


def test_the_check_pose_is_singular_and_still_held() -> None:
    pose = VIPER.flange_poses(np.radians([[0.0, -90.0, 180.0, 0.0, 0.0, 0.0]]))
    joints, reasons = inverse_kinematics(VIPER, pose)
    lefty_above = joints[0, Configuration.LEFTY_ABOVE_NOFLIP]
    assert reasons[0, Configuration.LEFTY_ABOVE_NOFLIP] == Reason.SINGULAR
    np.testing.assert_allclose(np.degrees(lefty_above), [0, -90, 180, 0, 0, 0], atol=1e-9)


@pytest.mark.parametrize("j46_deg", [(0.0, 0.0), (30.0, -70.0), (170.0, 300.0)])
def test_a_wrist_singularity_is_named_and_its_solution_holds_the_pose(j46_deg: tuple[float, float]) -> None:
    pose = VIPER.flange_poses(np.radians([[20.0, -60.0, 150.0, j46_deg[0], 0.0, j46_deg[1]]]))
    joints, reasons = inverse_kinematics(VIPER, pose)
    for slot in (Configuration.LEFTY_ABOVE_FLIP, Configuration.LEFTY_ABOVE_NOFLIP):
        assert reasons[0, slot] == Reason.SINGULAR
    assert joints[0, Configuration.LEFTY_ABOVE_NOFLIP, 3] == 0.0
    np.testing.assert_allclose(VIPER.flange_poses(joints[:, 1])[0], pose[0], atol=1e-6)


def test_a_wrist_on_axis_1_is_singular_on_both_sides() -> None:
    pose = np.eye(4)[np.newaxis]
    pose[0, :3, :3] = [[0, 0, 1], [0, 1, 0], [-1, 0, 0]]
    pose[0, :3, 3] = [80.0, 0.0, 700.0]
    joints, reasons = inverse_kinematics(VIPER, pose)
    assert (reasons == Reason.SINGULAR).all()
    np.testing.assert_allclose(VIPER.flange_poses(joints[0]), np.repeat(pose, 8, axis=0), atol=1e-6)


@pytest.mark.parametrize("position_mm", [(800.0, 0.0, 335.0), (0.0, 0.0, 1500.0), (155.0, 0.0, 335.0)])
def test_out_of_reach_is_said_and_no_joints_are_given(position_mm: tuple[float, float, float]) -> None:
    pose = np.eye(4)[np.newaxis]
    pose[0, :3, :3] = [[0, 0, 1], [0, 1, 0], [-1, 0, 0]]
    pose[0, :3, 3] = position_mm
    joints, reasons = inverse_kinematics(VIPER, pose)
    assert (reasons[0, :4] == Reason.OUT_OF_REACH).all()
    assert np.isnan(joints[0, :4]).all()


@pytest.mark.parametrize("joint", range(6))
def test_the_limit_that_is_passed_is_named(joint: int) -> None:
    start_deg = np.array([[10.0, -60.0, 150.0, 20.0, 40.0, 30.0]])
    lower, upper = list(VIPER.lower_deg), list(VIPER.upper_deg)
    lower[joint], upper[joint] = start_deg[0, joint] + 1.0, start_deg[0, joint] + 2.0
    narrow = Arm("narrow", VIPER.d_mm, VIPER.a_mm, VIPER.alpha_deg, tuple(lower), tuple(upper), VIPER.max_speed_deg_s)
    joints, reasons = inverse_kinematics(narrow, VIPER.flange_poses(np.radians(start_deg)))
    assert reasons[0, Configuration.LEFTY_ABOVE_NOFLIP] == Reason.JOINT_1_LIMIT + joint
    np.testing.assert_allclose(np.degrees(joints[0, Configuration.LEFTY_ABOVE_NOFLIP]), start_deg[0], atol=1e-9)


def test_each_joint_is_on_the_turn_nearest_mid_range() -> None:
    joints, reasons = inverse_kinematics(VIPER, VIPER.flange_poses(random_joints(VIPER, 2_000, seed=6)))
    middle = np.radians(np.add(VIPER.lower_deg, VIPER.upper_deg) / 2.0)
    assert np.abs(joints[reasons != Reason.OUT_OF_REACH] - middle).max() <= np.pi + 1e-9


def test_a_pose_that_is_not_a_number_is_out_of_reach() -> None:
    _, reasons = inverse_kinematics(VIPER, np.full((1, 4, 4), np.nan))
    assert (reasons == Reason.OUT_OF_REACH).all()


KUKA = Arm.load("kuka_kr6_r700")


def with_conventions(arm: Arm, sign: tuple[float, ...], offset_deg: tuple[float, ...]) -> Arm:
    """The same arm with another counting of its angles; the limits allow the same postures."""
    ends = (np.degrees(arm.limits) - offset_deg) * np.array(sign)
    lower, upper = np.sort(ends, axis=0)
    return replace(arm, sign=sign, offset_deg=offset_deg, lower_deg=tuple(lower), upper_deg=tuple(upper))


def oracle_of_robot(arm: Arm) -> Robot:
    """Return the ortho-parallel model that counts joints as the robot does: angle x sign - offset."""
    mirror = np.array([1, -1, -1, 1, -1, 1]) if arm.alpha_deg[0] > 0 else np.ones(6)
    upright = np.radians([0, -90, 90, 0, 0, 0])
    model = KinematicModel(
        a1=arm.a_mm[0],
        a2=arm.a_mm[2],
        b=(arm.d_mm[1] + arm.d_mm[2]) * mirror[1],
        c1=arm.d_mm[0],
        c2=arm.a_mm[1],
        c3=arm.d_mm[3],
        c4=arm.d_mm[5],
        offsets=tuple(upright - mirror * np.radians(arm.offset_deg)),
        flip_axes=tuple((mirror * np.array(arm.sign)) < 0),
    )
    return Robot(model, degrees=False)


CONVENTIONS = [
    KUKA,
    with_conventions(VIPER, (1, -1, 1, -1, -1, 1), (0, -90, 180, 0, 0, 45)),
    with_conventions(PUMA, (-1, 1, -1, 1, -1, -1), (30, 0, -90, 10, 0, 0)),
]


@pytest.mark.parametrize("arm", CONVENTIONS, ids=["kuka", "viper", "puma"])
def test_the_robots_own_angles_are_those_of_an_oracle_with_signs_and_offsets(arm: Arm) -> None:
    given_deg = np.random.default_rng(7).uniform(arm.lower_deg, arm.upper_deg, (2000, 6))
    poses = oracle_of_robot(arm).batch_forward(np.radians(given_deg))
    np.testing.assert_allclose(arm.flange_poses(arm.joints(given_deg)), poses.as_matrix(), atol=1e-9)
    joints, reasons = inverse_kinematics(arm, poses.as_matrix())
    expected = oracle_of_robot(arm).reach(poses).joints
    for ours, found, reason in zip(joints, expected, reasons, strict=True):
        robot = np.radians(arm.robot_deg(ours[reason != Reason.OUT_OF_REACH]))
        gaps = angle_between(robot[:, np.newaxis], found[np.newaxis]).max(axis=2)
        assert (np.nan_to_num(gaps, nan=9.0).min(axis=1) < 1e-6).all()
    rows, slots = np.arange(len(given_deg)), configurations(arm, arm.joints(given_deg))
    regular = away_from_singularities(arm, arm.joints(given_deg))
    assert (reasons[rows, slots][regular] == Reason.REACHED).all()


def test_the_kuka_is_where_its_makers_frames_and_another_program_put_it() -> None:
    """Its URDF's chain of joints, and a pose from the tests of Jmeyer1292/opw_kinematics, copied there from MoveIt."""
    axes = np.array([[0, 0, -1], [0, 1, 0], [0, 1, 0], [-1, 0, 0], [0, 1, 0], [-1, 0, 0]])
    steps_mm = np.array([[0, 0, 400], [25, 0, 0], [315, 0, 0], [0, 0, 35], [365, 0, 0], [80, 0, 0]])
    for robot_deg in np.random.default_rng(8).uniform(KUKA.lower_deg, KUKA.upper_deg, (50, 6)):
        expected = np.eye(4)
        for axis, step_mm, angle in zip(axes, steps_mm, np.radians(robot_deg), strict=True):
            joint = np.eye(4)
            joint[:3, :3], joint[:3, 3] = Rotation.from_rotvec(axis * angle).as_matrix(), step_mm
            expected = expected @ joint
        expected[:3, :3] = expected[:3, :3] @ Rotation.from_euler("y", 90.0, degrees=True).as_matrix()
        np.testing.assert_allclose(KUKA.flange_poses(KUKA.joints(robot_deg[np.newaxis]))[0], expected, atol=1e-9)
    pose = KUKA.flange_poses(KUKA.joints(np.degrees(np.full((1, 6), 0.2))))[0]
    np.testing.assert_allclose(pose[:3, 3], [734.1169, -152.0347, 182.639], atol=1e-4)
