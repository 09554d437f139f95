from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh

from planner.scanning.point_cloud import PlyWriter, XyzWriter, read_cloud, write_normals

POINTS = np.random.default_rng(0).uniform(-300.0, 300.0, (1000, 3))
BEAMS = POINTS / np.linalg.norm(POINTS, axis=1, keepdims=True)
NUMBERS = np.arange(1000) // 100


def write(file: Path, block: int) -> None:
    with PlyWriter(file, "test") as ply:
        for first in range(0, len(POINTS), block):
            part = slice(first, first + block)
            ply.write(POINTS[part], BEAMS[part], NUMBERS[part])


def properties(file: Path) -> Any:  # noqa: ANN401 - a structured array
    """Read a file by its header, like any program."""
    header, _, body = file.read_bytes().partition(b"end_header\n")
    names = [line.split() for line in header.decode("ascii").splitlines() if line.startswith("property")]
    kinds = {"float": "<f4", "uint": "<u4"}
    return np.frombuffer(body, dtype=[(name, kinds[kind]) for _, kind, name in names])


def test_another_program_reads_the_points(tmp_path: Path) -> None:
    write(tmp_path / "cloud.ply", 300)
    cloud = trimesh.load(tmp_path / "cloud.ply")
    assert isinstance(cloud, trimesh.PointCloud)
    assert np.abs(np.asarray(cloud.vertices) - POINTS).max() < 2e-5


def test_beams_and_profiles_are_beside_the_points(tmp_path: Path) -> None:
    write(tmp_path / "cloud.ply", 300)
    rows = properties(tmp_path / "cloud.ply")
    assert len(rows) == 1000
    assert np.abs(np.column_stack([rows[f"beam_{axis}"] for axis in "xyz"]) - BEAMS).max() < 1e-6
    assert (rows["profile"] == NUMBERS).all()


def test_a_cloud_is_read_back(tmp_path: Path) -> None:
    write(tmp_path / "cloud.ply", 300)
    points, beams = read_cloud(tmp_path / "cloud.ply")
    assert np.abs(points - POINTS).max() < 2e-5
    assert np.abs(beams - BEAMS).max() < 1e-6


def test_the_blocks_leave_no_trace(tmp_path: Path) -> None:
    write(tmp_path / "a.ply", 1000)
    write(tmp_path / "b.ply", 7)
    assert (tmp_path / "a.ply").read_bytes() == (tmp_path / "b.ply").read_bytes()


def test_a_cloud_appears_when_it_is_closed_and_what_was_written_is_kept(tmp_path: Path) -> None:
    file = tmp_path / "cloud.ply"

    def interrupted() -> None:
        with PlyWriter(file) as ply:
            ply.write(POINTS[:10], BEAMS[:10], NUMBERS[:10])
            assert not file.exists()
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        interrupted()
    assert len(properties(file)) == 10
    assert [each.name for each in tmp_path.iterdir()] == ["cloud.ply"]


def test_an_empty_cloud_is_a_sound_file(tmp_path: Path) -> None:
    with PlyWriter(tmp_path / "cloud.ply"):
        pass
    assert len(properties(tmp_path / "cloud.ply")) == 0


def test_text_keeps_a_tenth_of_a_micrometer(tmp_path: Path) -> None:
    with XyzWriter(tmp_path / "cloud.xyz") as xyz:
        xyz.write(POINTS[:600])
        xyz.write(POINTS[600:])
        xyz.write(POINTS[:0])
    assert np.abs(np.loadtxt(tmp_path / "cloud.xyz") - POINTS).max() <= 0.5e-4 + 1e-9


def test_another_program_reads_the_normals(tmp_path: Path) -> None:
    write_normals(tmp_path / "normals.ply", POINTS, BEAMS, "two\nlines")
    rows = properties(tmp_path / "normals.ply")
    assert np.abs(np.column_stack([rows[f"n{axis}"] for axis in "xyz"]) - BEAMS).max() < 1e-6
    cloud = trimesh.load(tmp_path / "normals.ply")
    assert isinstance(cloud, trimesh.PointCloud)
    assert np.abs(np.asarray(cloud.vertices) - POINTS).max() < 2e-5
