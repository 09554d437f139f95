"""Clearances from difficult meshes, compared with coal: thin walls, a cavity, two bodies, holes, a knot.

python -m tests.planner.clearance_sweep
"""

import sys
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import coal
import numpy as np
import trimesh

from planner.arrays import FloatArray
from planner.cell.bodies import FLANGE_FRAME
from planner.cell.collision_model import collision_model
from planner.cell.obstacles import workpiece_obstacle
from planner.cell.pose_clearance import clearances
from planner.cell.scan import Scan, load_scan
from planner.geometry.mesh import sound_mesh
from planner.geometry.signed_distance_field import build_field
from planner.geometry.transforms import rotations_z
from planner.geometry.winding_number import solid_angles
from tests.planner import parts
from tools.bench.timing import print_table

MESHES: tuple[Callable[[int], trimesh.Trimesh], ...] = (
    parts.thin_walls,
    parts.hollow_ball,
    parts.two_bodies,
    parts.perforated,
    parts.knot,
)
NEAR_MM = 60.0
"""Twice the default comfortable clearance, from which on the value does not depend on it."""
SCAN = load_scan("cylinder")
ARM = SCAN.cell.arm


class Compared(NamedTuple):
    """Our clearances and coal's `(n,)` in mm, of poses near the workpiece; -inf if a body is in it."""

    ours_mm: FloatArray
    true_mm: FloatArray
    spacing_mm: float

    @property
    def above_mm(self) -> float:
        """Maximum amount by which a clearance is above the true one."""
        return float(np.max(self.ours_mm - np.maximum(self.true_mm, 0.0)))

    @property
    def below_mm(self) -> float:
        """Maximum amount by which a clearance is below the true one."""
        free = self.true_mm > 0.0
        return float(np.max(self.true_mm[free] - self.ours_mm[free]))


def with_mesh(made: trimesh.Trimesh) -> Scan:
    """The scan with another workpiece."""
    mesh, _ = sound_mesh(np.asarray(made.vertices), np.asarray(made.faces))
    return replace(SCAN, workpiece=None, mesh=mesh, mesh_file=Path("part.stl"))


def compared(scan: Scan, poses: int, seed: int = 1) -> Compared:
    """Compare random poses that are near the workpiece."""
    obstacle = workpiece_obstacle(scan)
    assert obstacle.field is not None
    model, names = collision_model(scan.bodies, (obstacle,), scan.cell.T_BT, scan.cell.T_FS)
    kept = [i for i, name in enumerate(names) if name.endswith("workpiece") and not name.startswith("beam")]
    rng = np.random.default_rng(seed)
    joints, angles_deg = rng.uniform(ARM.limits[0], ARM.limits[1], (100 * poses, 6)), rng.uniform(0, 360, 100 * poses)
    model = model._replace(pairs=model.pairs[kept])
    ours_mm = clearances(model, ARM, joints, angles_deg, scan.cell.probe.stand_off_mm).clearance_mm
    surface, near, true_mm = coal_mesh(scan.mesh), [], []
    for i in np.flatnonzero(ours_mm < NEAR_MM):
        T_BW = scan.cell.T_BT @ rotations_z(angles_deg[[i]])[0] @ scan.cell.T_TW
        distance_mm = coal_clearance(scan.mesh, surface, T_BW, joints[i])
        if distance_mm < NEAR_MM:
            near.append(i)
            true_mm.append(distance_mm)
        if len(near) == poses:
            break
    return Compared(ours_mm[near], np.array(true_mm), obstacle.field.spacing_mm)


def coal_clearance(mesh: trimesh.Trimesh, surface: object, T_BW: FloatArray, joints: FloatArray) -> float:
    """The distance of the arm and the probe from a mesh, -inf if the middle of one of their bodies is in it."""
    least, (lower, upper) = np.inf, np.asarray(mesh.bounds)
    for shape, pose in body_shapes(joints):
        middle = (np.linalg.inv(T_BW) @ pose)[:3, 3]
        within_box = ((middle > lower) & (middle < upper)).all()
        if within_box and solid_angles(np.asarray(mesh.triangles), middle[np.newaxis])[0] > 2.0 * np.pi:
            return -np.inf
        distance = coal.distance(
            shape, placed(pose), surface, placed(T_BW), coal.DistanceRequest(), coal.DistanceResult()
        )
        least = min(least, distance)
    return float(least)


def body_shapes(joints: FloatArray) -> list[tuple[object, FloatArray]]:
    """The bodies that can meet the workpiece, and their positions in the base."""
    frames, shapes = ARM.link_frames(joints[np.newaxis])[0], []
    for part in SCAN.bodies.parts:
        if part.link > 0:
            along = part.end_mm - part.start_mm
            length = float(np.linalg.norm(along))
            local = np.eye(4)
            local[:3, :3] = coal.Quaternion.FromTwoVectors(np.array([0.0, 0.0, 1.0]), along / length).matrix()
            local[:3, 3] = (part.start_mm + part.end_mm) / 2
            shapes.append((coal.Capsule(part.radius_mm, length), frames[part.frame] @ local))
    housing = SCAN.bodies.housing
    shapes.append((coal.Box(*(2.0 * housing.half_mm)), frames[FLANGE_FRAME] @ housing.T_FH))
    return shapes


def placed(pose: FloatArray) -> object:
    return coal.Transform3s(pose[:3, :3], pose[:3, 3])


def coal_mesh(mesh: trimesh.Trimesh) -> object:
    model, vertices, faces = coal.BVHModelOBBRSS(), coal.StdVec_Vec3s(), coal.StdVec_Triangle()
    for vertex in np.asarray(mesh.vertices):
        vertices.append(vertex)
    for a, b, c in mesh.faces.tolist():
        faces.append(coal.Triangle(a, b, c))
    model.beginModel(len(mesh.faces), len(mesh.vertices))
    model.addSubModel(vertices, faces)
    model.endModel()
    return model


def main(poses: int = 300, triangles: int = 50_000) -> None:
    """Print a line for each mesh."""
    rows = []
    for make in MESHES:
        scan = with_mesh(make(triangles))
        found = compared(scan, poses)
        start = time.perf_counter()
        build_field(scan.mesh, found.spacing_mm)
        rows.append(
            (
                make.__name__,
                f"{len(scan.mesh.faces)}",
                f"{found.spacing_mm:.2f}",
                f"{time.perf_counter() - start:.2f}",
                f"{np.sum(found.true_mm > 0.0)}/{len(found.true_mm)}",
                f"{found.above_mm:.4f}",
                f"{found.below_mm:.2f}",
            )
        )
    header = ("mesh", "triangles", "spacing (mm)", "field (s)", "free/near", "highest above (mm)", "lowest below (mm)")
    print_table(sys.stdout, f"Clearances beside coal, {poses} poses within {NEAR_MM:g} mm", header, rows)


if __name__ == "__main__":
    main()
