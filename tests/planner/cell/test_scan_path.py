import json
from pathlib import Path

import numpy as np
import pytest

from planner.cell.cell import placement
from planner.cell.scan_path import ScanPath, at_scan_speed, load_scan_path, looking_at
from planner.errors import PathError

POSES = np.stack([placement(0.0, 0.0, 100.0, 0.0, 180.0, 0.0), placement(50.0, 0.0, 100.0, 30.0, 170.0, 10.0)])


def test_a_location_looks_along_the_inward_normal_from_the_stand_off() -> None:
    point, normal = np.array([[10.0, 20.0, 30.0]]), np.array([[0.6, 0.0, 0.8]])
    T = looking_at(point, normal, np.array([[0.0, 1.0, 0.0]]), stand_off_mm=150.0)[0]
    np.testing.assert_allclose(T @ [0.0, 0.0, 150.0, 1.0], [*point[0], 1.0], atol=1e-12)
    np.testing.assert_allclose(T[:3, 2], -normal[0])
    np.testing.assert_allclose(T[:3, 0], [0.0, 1.0, 0.0])
    assert np.linalg.det(T[:3, :3]) == pytest.approx(1.0)


def test_the_line_moves_over_the_surface_at_the_scan_speed() -> None:
    path = at_scan_speed(POSES[[0, 0]] + _shift(0.0, 300.0), 30.0, 0.5, stand_off_mm=150.0, line_width_mm=60.0)
    assert path.count == 21
    np.testing.assert_allclose(np.linalg.norm(np.diff(path.T_WS[:, :3, 3], axis=0), axis=1), 15.0)


def test_a_turn_on_the_spot_takes_the_time_of_the_line_ends() -> None:
    turned = np.stack([placement(0.0, 0.0, 0.0, 0.0, 180.0, roll) for roll in np.linspace(0.0, 90.0, 46)])
    path = at_scan_speed(turned, 10.0, 0.25, stand_off_mm=150.0, line_width_mm=60.0)
    assert path.count == 1 + round(30.0 * np.pi / 2.0 / (10.0 * 0.25))


def _shift(*x_mm: float) -> np.ndarray[tuple[int, ...], np.dtype[np.float64]]:
    shift = np.zeros((len(x_mm), 4, 4))
    shift[:, 0, 3] = x_mm
    return shift


@pytest.mark.parametrize(
    ("T_WS", "step_s", "message"),
    [
        (POSES[:1], 0.5, "the number of locations of the path is 1; it must be at least 2"),
        (POSES, 0.0, "time step is 0 s"),
        (POSES * np.nan, 0.5, "location 1 of the path holds a value that is not a finite number"),
        (POSES * [[[1.0]], [[1.5]]], 0.5, "location 2 of the path"),
    ],
)
def test_a_path_that_cannot_be_followed_is_refused(
    T_WS: np.ndarray[tuple[int, ...], np.dtype[np.float64]], step_s: float, message: str
) -> None:
    with pytest.raises(PathError, match=message):
        ScanPath(T_WS, step_s)


SIX = [[0, 0, 100, 0, 180, 0], [50, 0, 100, 30, 170, 10]]


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("six.csv", "x_mm,y_mm,z_mm,yaw,pitch,roll\n0,0,100,0,180,0\n\n50,0,100,30,170,10\n"),
        ("sixteen.csv", "\n".join(",".join(f"{value:.6f}" for value in T.ravel()) for T in POSES)),
        ("six.json", json.dumps(SIX)),
        ("matrices.json", json.dumps(POSES.tolist())),
        ("mixed.json", json.dumps([SIX[0], POSES[1].ravel().tolist()])),
    ],
)
def test_a_path_is_read_from_a_file(tmp_path: Path, name: str, text: str) -> None:
    file = tmp_path / name
    file.write_text(text)
    path = load_scan_path(file, 0.5)
    np.testing.assert_allclose(path.T_WS, POSES, atol=1e-5)
    assert path.step_s == 0.5


@pytest.mark.parametrize(
    ("name", "text", "message"),
    [
        ("path.txt", "", "must end in .csv or .json"),
        ("path.csv", "", "at least 2"),
        ("path.csv", "0,0,100,0,180,0\n", "at least 2"),
        ("path.csv", "0,0,100,0,180,0\n0,0,x,0,180,0\n", "line 2 holds '0,0,x,0,180,0'"),
        ("path.csv", "0,0,100,0,180\n0,0,100,0,180\n", "pose 1 has 5 numbers"),
        ("path.csv", "0,0,100,0,180,0\n0,0,nan,0,180,0\n", "pose 2 holds a value that is not a finite number"),
        ("path.json", "{", "is not JSON"),
        ("path.json", "{}", "must hold a list"),
        ("path.json", '[["a"], [1]]', "pose 1 must be"),
        ("path.json", '[[1, 2, 3, 4, 5, 6], ["1", "2", "3", "4", "5", "6"]]', "pose 2 must be"),
        ("path.json", "[[1, 2, 3, 4, 5, true]]", "pose 1 must be"),
        ("path.json", "[[[1, 2, 3], [4, 5, 6]]]", "pose 1 must be"),
        ("path.json", json.dumps([SIX[0], (2 * POSES[1]).tolist()]), "pose 2 has a last row other than 0 0 0 1"),
        ("path.json", json.dumps([SIX[0], np.diag([1, 1, 3, 1]).tolist()]), "pose 2 is not rigid"),
    ],
)
def test_a_bad_file_is_refused_in_one_sentence(tmp_path: Path, name: str, text: str, message: str) -> None:
    file = tmp_path / name
    file.write_text(text)
    with pytest.raises(PathError, match=message) as refusal:
        load_scan_path(file, 0.5)
    assert str(refusal.value).startswith(str(file))


def test_a_missing_file_is_named(tmp_path: Path) -> None:
    with pytest.raises(PathError, match=r"absent.csv: cannot be read"):
        load_scan_path(tmp_path / "absent.csv", 0.5)
