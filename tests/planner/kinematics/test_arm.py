from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from planner.arrays import FloatArray
from planner.errors import ArmTableError, ScanFileError
from planner.kinematics.arm import Arm

VIPER = Arm.load()


def test_the_check_pose_of_the_viper() -> None:
    pose = VIPER.flange_poses(np.radians([[0.0, -90.0, 180.0, 0.0, 0.0, 0.0]]))[0]
    expected = [[0, 0, 1, 450], [0, 1, 0, 0], [-1, 0, 0, 695], [0, 0, 0, 1]]
    np.testing.assert_allclose(pose, expected, atol=1e-12)


def test_the_stretched_arm_puts_its_wrist_at_its_reach() -> None:
    stretched_deg = 90.0 + np.degrees(np.arctan2(90.0, 295.0))
    frames = VIPER.link_frames(np.radians([[0.0, 0.0, stretched_deg, 0.0, 0.0, 0.0]]))[0]
    assert np.hypot(frames[4, 0, 3], frames[4, 1, 3]) == pytest.approx(75.0 + 270.0 + np.hypot(90.0, 295.0))


def test_link_frames_are_the_products_of_the_table_rows() -> None:
    joints = np.random.default_rng(1).uniform(-3.0, 3.0, 6)
    frame = np.eye(4)
    for j, frame_after_joint in enumerate(VIPER.link_frames(joints[np.newaxis])[0]):
        np.testing.assert_allclose(frame_after_joint, frame, atol=1e-12)
        if j < 6:
            frame = frame @ _denavit_hartenberg(VIPER, j, joints[j])


def _denavit_hartenberg(arm: Arm, j: int, theta: float) -> FloatArray:
    c, s = np.cos(theta), np.sin(theta)
    ca, sa = np.cos(np.radians(arm.alpha_deg[j])), np.sin(np.radians(arm.alpha_deg[j]))
    turn = np.array([[c, -s, 0, 0], [s, c, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]])
    twist = np.array([[1, 0, 0, arm.a_mm[j]], [0, ca, -sa, 0], [0, sa, ca, arm.d_mm[j]], [0, 0, 0, 1]])
    return np.asarray(turn @ twist)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"alpha_deg": (-90.0, 0.0, 90.0, -90.0, 60.0, 0.0)}, "ortho-parallel"),
        ({"alpha_deg": (-90.0, 0.0, 90.0, 90.0, -90.0, 0.0)}, "ortho-parallel"),
        ({"a_mm": (75.0, 270.0, -90.0, 0.0, 10.0, 0.0)}, "spherical wrist"),
        ({"d_mm": (335.0, 0.0, 0.0, 295.0, 12.0, 80.0)}, "spherical wrist"),
        ({"a_mm": (75.0, 0.0, -90.0, 0.0, 0.0, 0.0)}, "above 0"),
        ({"lower_deg": (-170.0, 45.0, -29.0, -190.0, -120.0, -360.0)}, "joint 2 are 45..45 deg"),
        ({"max_speed_deg_s": (328.0, 300.0, 375.0, 0.0, 375.0, 600.0)}, "speed of joint 4 is 0"),
        ({"d_mm": (335.0, 0.0, 0.0, float("nan"), 0.0, 80.0)}, "finite"),
        ({"sign": (1.0, 1.0, 0.5, 1.0, 1.0, 1.0)}, "sign of joint 3 is 0.5; it must be 1 or -1"),
    ],
)
def test_a_table_that_the_closed_form_does_not_cover_is_refused(
    change: dict[str, tuple[float, ...]], message: str
) -> None:
    with pytest.raises(ArmTableError, match=message):
        replace(VIPER, **change)  # type: ignore[arg-type]  # each case changes one column


def test_an_arm_file_with_an_unknown_key_is_refused_by_its_name(tmp_path: Path) -> None:
    shipped = Path(__file__).parents[3] / "planner" / "arms" / "viper_s650.toml"
    mistyped = tmp_path / "arm.toml"
    mistyped.write_text(shipped.read_text().replace("alpha_deg = 0", "alpha_deg = 0\npayload_kg = 5", 1))
    with pytest.raises(ScanFileError, match=r"arm.toml: joint\[2\].payload_kg is not a known key"):
        Arm.load(mistyped)


def test_another_arm_is_another_file(tmp_path: Path) -> None:
    shipped = Path(__file__).parents[3] / "planner" / "arms" / "viper_s650.toml"
    longer = tmp_path / "arm.toml"
    longer.write_text(shipped.read_text().replace("d_mm = 80", "d_mm = 95"))
    assert Arm.load(longer).d_mm == (335.0, 0.0, 0.0, 295.0, 0.0, 95.0)


def test_the_robots_own_angles_and_the_tables_are_turned_into_each_other() -> None:
    kuka = Arm.load("kuka_kr6_r700")
    robot_deg = np.array([[10.0, -20.0, 30.0, 40.0, 50.0, 60.0]])
    np.testing.assert_allclose(np.degrees(kuka.joints(robot_deg)), [[-10.0, -20.0, 120.0, -40.0, 50.0, -60.0]])
    np.testing.assert_allclose(kuka.robot_deg(kuka.joints(robot_deg)), robot_deg)


def test_limits_of_a_joint_that_counts_the_other_way_round_change_places() -> None:
    turned = replace(
        VIPER,
        sign=(1, 1, 1, -1, 1, 1),
        offset_deg=(0, 0, 0, 10, 0, 0),
        lower_deg=(*VIPER.lower_deg[:3], -50, *VIPER.lower_deg[4:]),
    )
    np.testing.assert_allclose(np.degrees(turned.limits[:, 3]), [10 - 190, 10 + 50])


def test_a_sign_or_an_offset_of_an_arm_file_is_read(tmp_path: Path) -> None:
    shipped = Path(__file__).parents[3] / "planner" / "arms" / "viper_s650.toml"
    file = tmp_path / "arm.toml"
    file.write_text(shipped.read_text().replace("d_mm = 80", "d_mm = 80\nsign = -1\noffset_deg = 30"))
    assert Arm.load(file).sign == (1.0, 1.0, 1.0, 1.0, 1.0, -1.0)
    assert Arm.load(file).offset_deg == (0.0, 0.0, 0.0, 0.0, 0.0, 30.0)
