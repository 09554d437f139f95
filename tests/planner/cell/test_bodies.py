import itertools
from pathlib import Path

import numpy as np
import pytest

from planner.cell.bodies import load_bodies, shipped_bodies
from planner.cell.cell import Probe, placement
from planner.errors import ScanFileError

SHIPPED = Path("planner/bodies/viper_s650.toml")
T_FS = placement(10.0, -20.0, 100.0, 30.0, 40.0, 50.0)


def test_the_probes_housing_ends_at_its_exit_plane() -> None:
    housing = load_bodies(Probe(body_mm=(20.0, 40.0, 60.0)), T_FS).housing
    corners = np.array(list(itertools.product((-1, 1), repeat=3))) * housing.half_mm
    in_S = (np.linalg.inv(T_FS) @ housing.T_FH)[:3]
    np.testing.assert_allclose((corners @ in_S[:, :3].T + in_S[:, 3]).min(axis=0), [-10.0, -20.0, -60.0], atol=1e-9)
    np.testing.assert_allclose((corners @ in_S[:, :3].T + in_S[:, 3]).max(axis=0), [10.0, 20.0, 0.0], atol=1e-9)


@pytest.mark.parametrize("name", shipped_bodies())
def test_shipped_parts_follow_the_arm_from_base_to_probe(name: str) -> None:
    bodies = load_bodies(Probe(), T_FS, name)
    links = [*(part.link for part in bodies.parts), bodies.housing.link]
    assert links == sorted(links)
    names = list(dict.fromkeys(part.name for part in bodies.parts))
    assert names == ["base", "shoulder", "upper arm", "elbow", "forearm", "wrist", "probe mount"]
    assert np.allclose(bodies.parts[-1].start_mm, 0.0)  # the mount begins at the flange


def test_every_shipped_arm_has_its_bodies() -> None:
    assert shipped_bodies() == sorted(file.stem for file in Path("planner/arms").glob("*.toml"))


def test_a_part_may_have_several_capsules(tmp_path: Path) -> None:
    file = tmp_path / "bodies.toml"
    row = "[[elbow]]\nstart_mm = [{}, 0, 0]\nend_mm = [0, 0, 0]\nradius_mm = 30\n"
    file.write_text(SHIPPED.read_text().replace("[elbow]", row.format(40) + row.format(50) + "[[elbow]]"))
    bodies = load_bodies(Probe(), T_FS, file)
    assert [part.start_mm[0] for part in bodies.parts if part.name == "elbow"] == [40.0, 50.0, 90.0]
    file.write_text(file.read_text().replace("[50, 0, 0]", "[50, 0]"))
    with pytest.raises(ScanFileError, match=r"elbow\[2\].start_mm is \[50, 0\]; it must be a list of 3"):
        load_bodies(Probe(), T_FS, file)


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
