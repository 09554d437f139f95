import itertools
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from planner.cell.bodies import load_bodies
from planner.cell.cell import Probe, placement
from planner.errors import ScanFileError
from planner.geometry.capsule import segment_distance

SHIPPED = Path("planner/bodies/viper_s650.toml")
T_FS = placement(10.0, -20.0, 100.0, 30.0, 40.0, 50.0)
side = st.floats(20.0, 200.0)


@settings(deadline=None, max_examples=50)
@given(x=side, y=side, z=side)
def test_the_probes_capsules_cover_its_housing(x: float, y: float, z: float) -> None:
    bodies = load_bodies(Probe(body_mm=(x, y, z)), T_FS)
    housing = [part for part in bodies.parts if part.name == "probe"]
    corners = itertools.product((-x / 2, x / 2), (-y / 2, 0.0, y / 2), (-z, -z / 2, 0.0))
    for corner in corners:
        at_flange = T_FS[:3, :3] @ corner + T_FS[:3, 3]
        point = (float(at_flange[0]), float(at_flange[1]), float(at_flange[2]))
        assert any(
            segment_distance(*point, *point, *map(float, (*part.start_mm, *part.end_mm))) <= part.radius_mm + 1e-9
            for part in housing
        )


def test_the_shipped_parts_follow_the_arm_from_base_to_probe() -> None:
    bodies = load_bodies(Probe(), T_FS)
    links = [part.link for part in bodies.parts]
    assert links == sorted(links)
    assert [part.name for part in bodies.parts][:2] == ["base", "shoulder"]
    assert np.allclose(bodies.parts[-3].start_mm, 0.0)  # the mount begins at the flange


@pytest.mark.parametrize(
    ("wrong", "told"),
    [
        ("radius_mm = 90", "base.radius_mm"),
        ("end_mm = [0, 0, 295]", "forearm.end_mm"),
        ("gap_mm = 20", "beam.gap_mm"),
    ],
)
def test_a_file_with_a_missing_value_is_refused_by_its_key(wrong: str, told: str, tmp_path: Path) -> None:
    file = tmp_path / "bodies.toml"
    file.write_text(SHIPPED.read_text().replace(wrong, ""))
    with pytest.raises(ScanFileError, match=told):
        load_bodies(Probe(), T_FS, file)


def test_a_part_that_nobody_knows_is_refused(tmp_path: Path) -> None:
    file = tmp_path / "bodies.toml"
    file.write_text(SHIPPED.read_text() + "\n[tail]\nradius_mm = 3\n")
    with pytest.raises(ScanFileError, match="tail is not a known key"):
        load_bodies(Probe(), T_FS, file)
