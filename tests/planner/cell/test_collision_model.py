import numpy as np
import pytest
import trimesh

from planner.cell.bodies import Bodies, load_bodies
from planner.cell.cell import Cell, placement
from planner.cell.collision_model import CollisionModel, collision_model
from planner.cell.obstacles import Obstacle, cell_obstacles, sphere
from planner.geometry.box_distance import FIELD
from planner.geometry.signed_distance_field import build_field

CELL = Cell(T_BT=placement(430.0, 0.0, 120.0, 0.0, 0.0, 0.0))
BODIES = load_bodies(CELL.probe, CELL.T_FS)


def model_with(*obstacles: Obstacle, bodies: Bodies = BODIES) -> tuple[CollisionModel, tuple[str, ...]]:
    return collision_model(bodies, obstacles, CELL.T_BT, CELL.T_FS)


def test_each_pair_that_can_meet_is_looked_at_and_no_neighbors() -> None:
    _, names = model_with(*cell_obstacles(CELL))
    assert "probe and table" in names
    assert "probe and forearm" in names
    assert "forearm and base" in names
    assert "beam and upper arm" in names
    for neighbors in (
        "elbow and upper arm",
        "wrist and forearm",
        "probe and wrist",
        "base and table",
        "beam and probe",
    ):
        assert neighbors not in names
        assert " and ".join(reversed(neighbors.split(" and "))) not in names


def test_light_passes_what_does_not_stop_it_and_the_arm_does_not() -> None:
    unseen = sphere("unseen space", 50.0, np.eye(4), turning=True)
    _, solid_names = model_with(unseen)
    _, names = model_with(unseen._replace(stops_light=False))
    assert set(solid_names) - set(names) == {"beam and unseen space"}
    assert "probe and unseen space" in names


def test_one_mesh_is_all_a_model_takes() -> None:
    field = build_field(trimesh.creation.box((20.0, 20.0, 20.0)), 5.0)
    mesh = Obstacle("mesh", FIELD, np.zeros(3), np.eye(4), turning=True, field=field)
    with pytest.raises(ValueError, match="2 obstacles are meshes"):
        model_with(mesh, mesh)


def test_a_part_on_the_wrists_own_joints_is_refused() -> None:
    parts = (*BODIES.parts, BODIES.parts[-1]._replace(frame=5))
    with pytest.raises(ValueError, match="frame 4 or 5"):
        model_with(bodies=BODIES._replace(parts=parts))
