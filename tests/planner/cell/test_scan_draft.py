"""The first scan that is tried for a part: the table can undo its turns."""

from pathlib import Path

import numpy as np
import pytest
import trimesh

from planner.cell.scan_draft import Part, drafts
from planner.table.motion import Limits

PARTS = {
    "cone": trimesh.creation.cone(radius=50.0, height=90.0, sections=64),
    "upside-down cone": trimesh.creation.revolve([[0, 0], [25, 0], [60, 90], [0, 90]], sections=64),
    "thin tube": trimesh.creation.annulus(9.0, 10.0, 150.0, sections=48),
    "rod": trimesh.creation.cylinder(radius=8.0, height=220.0, sections=48),
    "stepped shaft": trimesh.creation.revolve(
        [[0, 0], [30, 0], [30, 40], [20, 40], [20, 90], [12, 90], [12, 130], [0, 130]], sections=64
    ),
}


@pytest.mark.parametrize("name", PARTS)
def test_a_turned_part_begins_with_rings_that_the_table_can_undo(name: str) -> None:
    first = next(drafts(Part(PARTS[name], Path("part.stl"))))
    assert (first.kind, first.pattern) == ("cylinder", "rings")
    beams = first.path().T_WS[:, :2, 2]
    turns_rad = np.diff(np.unwrap(np.arctan2(beams[:, 1], beams[:, 0])))
    assert np.degrees(np.abs(turns_rad).max()) / first.step_s < 0.65 * Limits().speed_deg_s
