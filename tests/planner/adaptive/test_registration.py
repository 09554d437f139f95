import numpy as np
import pytest
import trimesh

from planner.adaptive.registration import Joined, join
from planner.adaptive.registration_cloud import Cloud
from planner.arrays import FloatArray
from planner.cell.cell import placement
from planner.geometry.thinned_cloud import ThinnedCloud
from planner.geometry.transforms import rigid_inverse

CELL_MM = 1.5
TURNED_OVER = placement(4.0, 5.0, 20.0, 30.0, 160.0, 20.0)


def bracket() -> trimesh.Trimesh:
    """Return an L of two plates with a rib on one side only."""
    plates = [((0, 0, 0), (70, 50, 12)), ((0, 0, 0), (12, 50, 45)), ((20, 5, 12), (30, 13, 27))]
    boxes = [trimesh.creation.box(bounds=np.array(bounds, dtype=float)) for bounds in plates]
    mesh: trimesh.Trimesh = trimesh.util.concatenate(boxes)  # type: ignore[assignment]  # of meshes: a mesh
    return mesh


PARTS = {
    "box": lambda: trimesh.creation.box((70.0, 45.0, 30.0)),
    "prism": lambda: trimesh.creation.cylinder(radius=30.0, height=40.0, sections=6),
    "cylinder": lambda: trimesh.creation.cylinder(radius=25.0, height=50.0, sections=96),
}


def scanned(mesh: trimesh.Trimesh, T: FloatArray, above_mm: float = 2.0, seed: int = 0) -> Cloud:
    """Return what a probe sees from above and all around of a part that stands at `T`: not its underside."""
    placed = mesh.copy()
    placed.apply_transform(T)
    points, triangles = trimesh.sample.sample_surface(placed, 60_000, seed=seed)
    normals = np.asarray(placed.face_normals)[triangles]
    seen = (normals[:, 2] > -0.3) & (points[:, 2] > points[:, 2].min() + above_mm)
    noise = 0.025 * np.random.default_rng(seed).standard_normal((int(seen.sum()), 3))
    thin = ThinnedCloud(CELL_MM)
    thin.take(np.asarray(points)[seen] + noise, -normals[seen])
    return Cloud.of(thin)


def test_a_part_that_was_turned_over_is_put_back() -> None:
    mesh = bracket()
    about = rigid_inverse(placement(8.0, -6.0, 3.0, 20.0, 5.0, 0.0) @ TURNED_OVER)
    joined = join(scanned(mesh, np.eye(4)), scanned(mesh, TURNED_OVER, seed=1), about)
    assert isinstance(joined, Joined)
    corners = np.asarray(mesh.vertices)
    T = joined.T_12 @ TURNED_OVER
    assert np.abs(corners @ T[:3, :3].T + T[:3, 3] - corners).max() < 0.08
    assert joined.overlap.share > 0.4
    assert joined.uncertainty_mm < 0.05


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("cylinder", "leaves a motion free"),
        ("box", "symmetric"),
        ("prism", "symmetric"),
    ],
)
def test_a_part_whose_shape_does_not_determine_the_pose_is_refused(name: str, words: str) -> None:
    mesh = PARTS[name]()
    joined = join(scanned(mesh, np.eye(4)), scanned(mesh, TURNED_OVER, seed=1), rigid_inverse(TURNED_OVER))
    assert isinstance(joined, str)
    assert words in joined


def test_too_small_an_overlap_is_refused() -> None:
    mesh = bracket()
    upside_down = placement(0.0, 0.0, 0.0, 0.0, 180.0, 0.0)
    low = scanned(mesh, np.eye(4), above_mm=30.0)
    joined = join(low, scanned(mesh, upside_down, above_mm=34.0, seed=1), upside_down)
    assert isinstance(joined, str)


def test_a_few_points_are_refused() -> None:
    few = Cloud(np.eye(3), np.eye(3), np.eye(3), 1.0)
    assert join(few, few, np.eye(4)) == "a cloud has 3 points; 100 are needed"
