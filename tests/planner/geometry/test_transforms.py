import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from planner.geometry.transforms import (
    first_not_rigid,
    from_xyz_yaw_pitch_roll,
    nearest_rigid,
    rigid_inverse,
)

ANGLES = st.floats(-180.0, 180.0)


@settings(max_examples=50)
@given(yaw=ANGLES, pitch=st.one_of(st.sampled_from([0.0, 180.0]), st.floats(0.0, 180.0)), roll=ANGLES)
def test_yaw_pitch_roll_is_zyz(yaw: float, pitch: float, roll: float) -> None:
    T = from_xyz_yaw_pitch_roll(np.array([[1.0, 2.0, 3.0, yaw, pitch, roll]]))
    expected = Rotation.from_euler("ZYZ", [yaw, pitch, roll], degrees=True).as_matrix()
    np.testing.assert_allclose(T[0, :3, :3], expected, atol=1e-12)
    np.testing.assert_allclose(T[0, :, 3], [1.0, 2.0, 3.0, 1.0])


def test_the_rigid_inverse_is_the_inverse() -> None:
    T = np.tile(np.eye(4), (20, 1, 1))
    rng = np.random.default_rng(1)
    T[:, :3, :3] = Rotation.random(20, rng=rng).as_matrix()
    T[:, :3, 3] = rng.uniform(-500.0, 500.0, (20, 3))
    np.testing.assert_allclose(rigid_inverse(T), np.linalg.inv(T), atol=1e-9)


@pytest.mark.parametrize(
    ("row", "column", "value", "why"),
    [
        (0, 0, np.nan, "finite"),
        (0, 3, np.inf, "finite"),
        (3, 0, 1.0, "last row"),
        (1, 1, 1.1, "right angles"),
        (0, 1, 0.1, "right angles"),
        (2, 2, -1.0, "left-handed"),
    ],
)
def test_the_first_pose_that_is_not_rigid_is_found_with_its_reason(
    row: int, column: int, value: float, why: str
) -> None:
    T = np.tile(np.eye(4), (3, 1, 1))
    assert first_not_rigid(T) is None
    T[1, row, column] = value
    fault = first_not_rigid(T)
    assert fault is not None
    assert fault[0] == 1
    assert why in fault[1]


def test_the_rounding_of_a_file_is_taken_out() -> None:
    exact = from_xyz_yaw_pitch_roll(np.array([[10.0, 20.0, 30.0, 33.0, 44.0, 55.0]]))
    rigid = nearest_rigid(np.round(exact, 4))
    np.testing.assert_allclose(rigid[0, :3, :3] @ rigid[0, :3, :3].T, np.eye(3), atol=1e-14)
    np.testing.assert_allclose(rigid, exact, atol=1e-4)
