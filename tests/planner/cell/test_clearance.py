from dataclasses import replace

import coal
import numpy as np
import pytest
import trimesh
from numpy.typing import NDArray

from planner.cell.bodies import FLANGE_FRAME, Bodies, load_bodies
from planner.cell.cell import Cell, placement
from planner.cell.collision_model import CollisionModel, collision_model
from planner.cell.obstacles import Obstacle, box, cell_obstacles, cylinder, sphere, workpiece_obstacle
from planner.cell.pose_clearance import Clearances, clearances
from planner.cell.scan import load_scan
from planner.cell.workpiece import Cylinder, Mould, Sphere
from planner.geometry.solid import BOX, CYLINDER
from planner.geometry.transforms import rotations_z

Poses = NDArray[np.float64]

CELL = Cell(T_BT=placement(430.0, 0.0, 120.0, 0.0, 0.0, 0.0))
BODIES = load_bodies(CELL.probe, CELL.T_FS)
STAND_OFF_MM = CELL.probe.stand_off_mm


def at(x: float, y: float, z: float) -> Poses:
    pose = np.eye(4)
    pose[:3, 3] = x, y, z
    return pose


def model_with(*obstacles: Obstacle, bodies: Bodies = BODIES) -> tuple[CollisionModel, tuple[str, ...]]:
    return collision_model(bodies, obstacles, CELL.T_BT, CELL.T_FS)


def random_joints(count: int, seed: int = 0) -> Poses:
    rng = np.random.default_rng(seed)
    return rng.uniform(np.radians(CELL.arm.lower_deg), np.radians(CELL.arm.upper_deg), (count, 6))


def rate(model: CollisionModel, joints: Poses, angles_deg: Poses | None = None) -> Clearances:
    angles_deg = np.zeros(len(joints)) if angles_deg is None else angles_deg
    return clearances(model, CELL.arm, joints, angles_deg, STAND_OFF_MM)


def coal_solid(obstacle: Obstacle) -> object:
    a, b, c = obstacle.size_mm
    if obstacle.kind == BOX:
        return coal.Box(2 * a, 2 * b, 2 * c)
    return coal.Cylinder(a, 2 * b) if obstacle.kind == CYLINDER else coal.Sphere(a)


def coal_transform(pose: Poses) -> object:
    return coal.Transform3s(pose[:3, :3], pose[:3, 3])


def coal_scene(
    joints: Poses, angle_deg: float, obstacles: tuple[Obstacle, ...]
) -> dict[str, list[tuple[object, object]]]:
    """Return the shapes and their positions, by name."""
    frames = CELL.arm.link_frames(joints[None])[0]
    scene: dict[str, list[tuple[object, object]]] = {}
    for part in BODIES.parts:
        along = part.end_mm - part.start_mm
        length = float(np.linalg.norm(along))
        turn = coal.Quaternion.FromTwoVectors(np.array([0.0, 0.0, 1.0]), along / length).matrix()
        local = np.eye(4)
        local[:3, :3], local[:3, 3] = turn, (part.start_mm + part.end_mm) / 2
        shape = coal.Capsule(part.radius_mm, length)
        scene.setdefault(part.name, []).append((shape, coal_transform(frames[part.frame] @ local)))
    housing = BODIES.housing
    scene[housing.name] = [(coal.Box(*(2.0 * housing.half_mm)), coal_transform(frames[FLANGE_FRAME] @ housing.T_FH))]
    table = CELL.T_BT @ rotations_z(np.array([angle_deg]))[0]
    for obstacle in obstacles:
        pose = table @ obstacle.pose if obstacle.turning else obstacle.pose
        scene[obstacle.name] = [(coal_solid(obstacle), coal_transform(pose))]
    return scene


def coal_distance(first: list[tuple[object, object]], second: list[tuple[object, object]]) -> float:
    request = coal.DistanceRequest()
    return float(
        min(
            coal.distance(shape_a, pose_a, shape_b, pose_b, request, coal.DistanceResult())
            for shape_a, pose_a in first
            for shape_b, pose_b in second
        )
    )


def test_clearance_and_nearest_pair_are_those_that_coal_finds() -> None:
    obstacles = (
        *cell_obstacles(CELL),
        cylinder("pot", 60.0, 100.0, at(20.0, 10.0, 50.0), turning=True),
        sphere("ball", 40.0, at(-90.0, 30.0, 45.0), turning=True),
        box("post", (50.0, 50.0, 700.0), at(-250.0, 200.0, 350.0), turning=False),
    )
    model, names = model_with(*obstacles)
    joints = random_joints(300)
    angles_deg = np.linspace(0.0, 700.0, len(joints))
    ours = rate(model, joints, angles_deg)
    free = 0
    for i, angle_deg in enumerate(angles_deg):
        scene = coal_scene(joints[i], angle_deg, obstacles)
        pairs = {name: name.split(" and ") for name in names if not name.startswith("beam")}
        found = {name: coal_distance(scene[a], scene[b]) for name, (a, b) in pairs.items()}
        nearest = min(found.values())
        if nearest > 0.01 and ours.clearance_mm[i] > 0.0:
            free += 1
            assert ours.clearance_mm[i] == pytest.approx(nearest, abs=2e-3)
            assert found[names[ours.pair[i]]] == pytest.approx(nearest, abs=2e-3)
        else:
            assert ours.clearance_mm[i] <= 0.011 or names[ours.pair[i]].startswith("beam")
    assert free > 30


def test_the_beam_counts_only_where_something_blocks_it() -> None:
    joints = np.radians([[0.0, -90.0, 180.0, 0.0, 60.0, 0.0]])
    laser = (CELL.arm.flange_poses(joints) @ CELL.T_FS)[0]

    def beam_past(offset_mm: float) -> Clearances:
        pose = laser @ at(0.0, offset_mm, 100.0)
        model, _ = model_with(sphere("ball", 10.0, pose, turning=False))
        beam_only = np.flatnonzero(model.pairs[:, 0] == len(BODIES.parts) + 1)
        return rate(model._replace(pairs=model.pairs[beam_only]), joints)

    assert beam_past(13.0).pair[0] == -1
    assert np.isinf(beam_past(13.0).clearance_mm[0])
    assert beam_past(11.0).pair[0] == 0
    assert beam_past(11.0).clearance_mm[0] == pytest.approx(-1.0)


def test_the_beam_ends_short_of_the_surface() -> None:
    joints = np.radians([[0.0, -90.0, 180.0, 0.0, 60.0, 0.0]])
    laser = (CELL.arm.flange_poses(joints) @ CELL.T_FS)[0]
    surface = box("surface", (200.0, 200.0, 10.0), laser @ at(0.0, 0.0, STAND_OFF_MM + 5.0), turning=False)
    model, names = model_with(surface)
    assert names[rate(model, joints).pair[0]] != "beam and surface"


@pytest.mark.parametrize(
    "workpiece",
    [Sphere(120.0), Cylinder(100.0, 140.0, (20.0, 0.0, 0.0)), Mould(220.0, 140.0, 60.0, 180.0, 100.0, 40.0)],
)
def test_a_workpiece_is_as_far_as_its_mesh(workpiece: Sphere | Cylinder | Mould) -> None:
    T_TW = at(30.0, -20.0, 10.0) @ rotations_z(np.array([25.0]))[0]
    mesh = workpiece.mesh()
    scan = replace(load_scan("mould"), cell=replace(CELL, T_TW=T_TW), workpiece=workpiece, mesh=mesh)
    model, names = model_with(workpiece_obstacle(scan))
    only = np.flatnonzero([name == "forearm and workpiece" for name in names])
    model = model._replace(pairs=model.pairs[only])
    joints = random_joints(200, seed=3)
    ours = rate(model, joints).clearance_mm
    forearm = next(part for part in BODIES.parts if part.name == "forearm")
    along = np.linspace(forearm.start_mm, forearm.end_mm, 60)
    frames = CELL.arm.link_frames(joints)[:, forearm.frame]
    to_workpiece = np.linalg.inv(CELL.T_BT @ T_TW) @ frames
    points = np.einsum("nij,pj->npi", to_workpiece[:, :3, :3], along) + to_workpiece[:, None, :3, 3]
    near = np.linalg.norm(points, axis=2).min(axis=1) < 400.0
    exact = np.array([-trimesh.proximity.signed_distance(mesh, sampled).max() for sampled in points[near]])  # type: ignore[no-untyped-call]  # no types shipped
    exact -= forearm.radius_mm
    assert near.sum() > 20
    outside = exact > -forearm.radius_mm
    spacing = 4.0
    assert (ours[near] <= exact + 0.5)[outside].all()
    assert (ours[near] >= exact - 0.1 * np.abs(exact) - 2 * spacing)[outside].all()


def test_turning_the_table_turns_what_stands_on_it() -> None:
    joints, angles_deg = random_joints(50), np.full(50, 70.0)
    turned, _ = model_with(sphere("ball", 40.0, at(100.0, 0.0, 50.0), turning=True))
    placed, _ = model_with(sphere("ball", 40.0, rotations_z(np.array([70.0]))[0] @ at(100.0, 0.0, 50.0), turning=True))
    assert rate(turned, joints, angles_deg).clearance_mm == pytest.approx(rate(placed, joints).clearance_mm)


def test_poses_that_are_not_reached_are_refused() -> None:
    model, _ = model_with(*cell_obstacles(CELL))
    with pytest.raises(ValueError, match="not a finite number"):
        rate(model, np.full((1, 6), np.nan))
