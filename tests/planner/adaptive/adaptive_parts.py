"""Parts of adaptive scans that tests make, on the cell of the shipped scans."""

from dataclasses import replace

import numpy as np
import trimesh

from planner.adaptive.known_part import KnownPart
from planner.adaptive.policy import Returned
from planner.adaptive.surroundings import Surroundings
from planner.arrays import FloatArray
from planner.cell.obstacles import workpiece_obstacle
from planner.cell.scan import Scan, load_scan
from planner.scanning.probe import LaserProbe


def scan_of(mesh: trimesh.Trimesh) -> Scan:
    """A scan without a path of a part that stands on the table."""
    scan = load_scan("cylinder")
    return replace(scan, name="part", workpiece=None, mesh=mesh, mesh_file=None, predefined_path=None)


def policy_of(scan: Scan, share: float = 0.99, most: int = 200) -> KnownPart:
    probe = LaserProbe.of(scan.cell.probe)
    return KnownPart(Surroundings.of(scan), scan.mesh, workpiece_obstacle(scan), probe, share, most, 20.0)


def without_points(T_WS: FloatArray) -> Returned:
    return Returned(T_WS, np.zeros(0, dtype=np.int64), np.zeros((0, 3)))


def cup(depth_mm: float = 70.0) -> trimesh.Trimesh:
    """A round cup of 100 mm with a wall of 5 mm."""
    outline = np.array(
        [[0, 0], [50, 0], [50, depth_mm + 5], [45, depth_mm + 5], [45, 5], [0, 5.0]],
    )
    mesh = trimesh.creation.revolve(outline, sections=48)
    assert isinstance(mesh, trimesh.Trimesh)
    return mesh


def lump(scale: float = 1.0) -> trimesh.Trimesh:
    """A convex part of few faces that no turn brings onto itself; it stands on z = 0."""
    corners = np.random.default_rng(4).uniform(-1.0, 1.0, (14, 3)) * (38.0, 30.0, 32.0)
    mesh: trimesh.Trimesh = trimesh.convex.convex_hull(scale * corners)
    pose = trimesh.poses.compute_stable_poses(mesh)[0][0]
    mesh.apply_transform(pose)
    return mesh
