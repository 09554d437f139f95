from pathlib import Path

import numpy as np
import pytest

from planner.cell.cell import Cell, placement
from planner.cell.obstacles import cell_obstacles, workpiece_obstacle
from planner.cell.scan import load_scan
from planner.geometry.box_distance import FIELD
from planner.geometry.signed_distance_field import look_up
from planner.geometry.solid import CAPSULE, CYLINDER, cylinder_distance


@pytest.mark.parametrize(("name", "kind"), [("sphere", CAPSULE), ("cylinder", CYLINDER), ("mould", FIELD)])
def test_ideal_spheres_and_cylinders_are_themselves_and_all_else_is_a_field(name: str, kind: int) -> None:
    assert workpiece_obstacle(load_scan(name)).kind == kind


def test_a_mesh_file_is_a_field_even_where_it_has_a_class(tmp_path: Path) -> None:
    shipped = load_scan("cylinder")
    shipped.mesh.export(tmp_path / "part.stl")
    text = Path("planner/scans/cylinder.toml").read_text()
    dimensions = text[text.index("diameter_mm") : text.index("[path]")]
    (tmp_path / "scan.toml").write_text(text.replace(dimensions, 'mesh = "part.stl"\n'))
    obstacle = workpiece_obstacle(load_scan(tmp_path / "scan.toml"))
    assert obstacle.field is not None
    ideal = workpiece_obstacle(shipped)
    for x, y, z in np.random.default_rng(0).uniform([-60, -60, 5], [60, 60, 150], (50, 3)):
        lifted = z - float((ideal.pose - obstacle.pose)[2, 3])
        radius, half_height, _ = ideal.size_mm
        exact = cylinder_distance(x, y, lifted, radius, half_height)[0]
        assert look_up(*obstacle.field, x, y, z) == pytest.approx(exact, abs=obstacle.field.spacing_mm)


def test_the_table_stands_on_the_floor_of_the_base() -> None:
    cell = Cell(T_BT=placement(400.0, 0.0, 150.0, 0.0, 0.0, 0.0))
    shapes = {obstacle.name: obstacle for obstacle in cell_obstacles(cell)}
    top = {name: shape.pose[2, 3] + shape.size_mm[1 if shape.kind == CYLINDER else 2] for name, shape in shapes.items()}
    assert top["table"] == pytest.approx(0.0)
    assert top["plinth"] == pytest.approx(-cell.table.thickness_mm)
    assert top["plinth"] - 2 * shapes["plinth"].size_mm[1] == pytest.approx(-150.0)
    assert top["floor"] == pytest.approx(0.0)
    assert not shapes["floor"].turning


def test_a_table_on_the_floor_has_no_plinth() -> None:
    cell = Cell(T_BT=placement(400.0, 0.0, 15.0, 0.0, 0.0, 0.0))
    assert [obstacle.name for obstacle in cell_obstacles(cell)] == ["table", "floor"]
