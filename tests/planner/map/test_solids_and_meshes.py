"""A cylinder as a solid beside the same cylinder as a mesh."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from planner.cell.scan import load_scan
from planner.kinematics.configuration import Configuration
from planner.map.map_builder import build_maps
from planner.map.map_problem import map_problem

SHIPPED = Path(__file__).parents[3] / "planner" / "scans" / "cylinder.toml"
SIZES_MM = [(140.0, 150.2), *np.random.default_rng(5).uniform((100.0, 120.0), (160.0, 200.0), (4, 2)).round(1).tolist()]


@pytest.mark.parametrize(("diameter_mm", "height_mm"), SIZES_MM)
def test_a_cylinder_is_as_reachable_as_a_mesh_as_it_is_as_a_solid(
    diameter_mm: float, height_mm: float, tmp_path: Path
) -> None:
    lines = SHIPPED.read_text().splitlines()
    sizes = {"diameter_mm": diameter_mm, "height_mm": height_mm}
    text = [next((f"{name} = {size}" for name, size in sizes.items() if line.startswith(name)), line) for line in lines]
    file = tmp_path / "cylinder.toml"
    file.write_text("\n".join(text))
    solid = load_scan(file)
    of_solid, of_mesh = (
        build_maps(map_problem(scan), list(Configuration), 36)[Configuration.LEFTY_ABOVE_NOFLIP]
        for scan in (solid, replace(solid, mesh_file=Path("cylinder.stl")))
    )
    assert of_solid.allowed.any()
    assert len(of_mesh.blocked_locations) <= len(of_solid.blocked_locations) + 0.02 * of_solid.location_count
    assert abs(of_mesh.allowed.mean() - of_solid.allowed.mean()) < 0.01
