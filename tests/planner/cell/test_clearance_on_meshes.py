"""Clearances from meshes that are hard to judge, beside coal: thin walls, a cavity, two bodies, holes, a knot."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import coal
import numpy as np
import pytest
import trimesh

from planner.arrays import FloatArray
from planner.cell.bodies import FLANGE_FRAME
from planner.cell.clearance import clearances
from planner.cell.collision_model import collision_model
from planner.cell.obstacles import workpiece_obstacle
from planner.cell.scan import load_scan
from planner.geometry.mesh import sound_mesh
from planner.geometry.transforms import rotations_z
from planner.geometry.winding_number import solid_angles
from tests.planner import parts

POSES, TRIANGLES = 40, 2000
SCAN = load_scan("cylinder")
ARM = SCAN.cell.arm


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


def body_shapes(joints: FloatArray) -> list[tuple[object, FloatArray]]:
    """The bodies that can meet the workpiece, and where they are in the base."""
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


@pytest.mark.parametrize("make", [parts.thin_walls, parts.hollow_ball, parts.two_bodies, parts.perforated, parts.knot])
def test_no_clearance_is_above_the_one_that_coal_finds(make: Callable[[int], trimesh.Trimesh]) -> None:
    made = make(TRIANGLES)
    mesh, _ = sound_mesh(np.asarray(made.vertices), np.asarray(made.faces))
    obstacle = workpiece_obstacle(replace(SCAN, workpiece=None, mesh=mesh, mesh_file=Path("part.stl")))
    model, names = collision_model(SCAN.bodies, (obstacle,), SCAN.cell.T_BT, SCAN.cell.T_FS)
    kept = [i for i, name in enumerate(names) if name.endswith("workpiece") and not name.startswith("beam")]
    rng = np.random.default_rng(1)
    joints, angles_deg = rng.uniform(ARM.limits[0], ARM.limits[1], (4000, 6)), rng.uniform(0.0, 360.0, 4000)
    model = model._replace(pairs=model.pairs[kept])
    ours = clearances(model, ARM, joints, angles_deg, SCAN.cell.probe.stand_off_mm).clearance_mm
    near = np.flatnonzero(ours < 100.0)[:POSES]
    surface, free = coal_mesh(mesh), 0
    for i in near:
        T_BW = SCAN.cell.T_BT @ rotations_z(angles_deg[[i]])[0] @ SCAN.cell.T_TW
        truth = np.inf
        for shape, pose in body_shapes(joints[i]):
            middle = (np.linalg.inv(T_BW) @ pose)[:3, 3]
            if solid_angles(np.asarray(mesh.triangles), middle[np.newaxis])[0] > 2.0 * np.pi:
                truth = -np.inf
            distance = coal.distance(
                shape, placed(pose), surface, placed(T_BW), coal.DistanceRequest(), coal.DistanceResult()
            )
            truth = min(truth, distance)
        free += truth > 0.0
        assert ours[i] <= max(truth, 0.0) + 1e-3
    assert 20 < free < len(near)
