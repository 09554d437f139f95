"""The bodies that move with the arm: its links and the probe as capsules, and the probe's beam."""

from math import hypot, sqrt
from pathlib import Path
from typing import NamedTuple

import numpy as np

from planner.arrays import FloatArray
from planner.cell.cell import Probe
from planner.toml_table import TomlTable

_SHIPPED = Path(__file__).parents[1] / "bodies"

FLANGE_FRAME = 6
WRIST_LINK = 4
"""From this link on, parts are fixed to the flange."""
_PROBE_LINK = 5
_ARM_PARTS = {
    "base": (0, 0),
    "shoulder": (1, 1),
    "upper_arm": (2, 2),
    "elbow": (3, 3),
    "forearm": (3, 3),
    "wrist": (WRIST_LINK, FLANGE_FRAME),
}
"""Each part's link and frame."""
_HOUSING_MARGIN = 1.1
"""A capsule around a block must be thicker than its diagonal, or it covers the corners only by being endless."""


class Part(NamedTuple):
    """A part of the arm or the probe: a capsule that moves with one frame of the arm.

    Attributes:
        name: What reasons call it.
        link: Its place in the chain of bodies; parts of one link and of neighbouring links are not checked.
        frame: The frame it moves with: 0 the base, 1 to 6 the one after each joint.
        start_mm: `(3,)`, one end of its segment in that frame.
        end_mm: `(3,)`, the other end.
        radius_mm: The capsule's radius.
    """

    name: str
    link: int
    frame: int
    start_mm: FloatArray
    end_mm: FloatArray
    radius_mm: float


class Beam(NamedTuple):
    """The probe's beam: a capsule from the probe's origin along its z axis to `gap_mm` before the surface."""

    radius_mm: float
    gap_mm: float


class Bodies(NamedTuple):
    """All that moves with the arm."""

    parts: tuple[Part, ...]
    beam: Beam


def load_bodies(probe: Probe, T_FS: FloatArray, file: Path | str = "viper_s650") -> Bodies:
    """Return the arm's parts in a TOML file, or those of a shipped arm by its name, with the probe's.

    Args:
        probe: The probe.
        T_FS: `(4, 4)`, the probe in the flange's frame, in mm.
        file: The file, or the name.

    Raises:
        ScanFileError: The file cannot be read, or a key is missing, unknown or of the wrong type.
    """
    shipped = _SHIPPED / f"{file}.toml"
    top = TomlTable.load(shipped if shipped.is_file() else Path(file))
    parts = [_read_part(top, name, link, frame) for name, (link, frame) in _ARM_PARTS.items()]
    housing = _housing(probe, T_FS)
    mount = top.table("probe_mount")
    rear = (housing[-1].start_mm + housing[-1].end_mm) / 2
    radius_mm = mount.number("radius_mm", above=0.0)
    parts.append(Part("probe mount", WRIST_LINK, FLANGE_FRAME, np.zeros(3), rear, radius_mm))
    beam_table = top.table("beam")
    beam = Beam(beam_table.number("radius_mm", above=0.0), beam_table.number("gap_mm", at_least=0.0))
    for table in (mount, beam_table, top):
        table.finish()
    return Bodies((*parts, *housing), beam)


def _read_part(top: TomlTable, name: str, link: int, frame: int) -> Part:
    table = top.table(name)
    start, end = (np.array(table.numbers(key, 3)) for key in ("start_mm", "end_mm"))
    radius_mm = table.number("radius_mm", above=0.0)
    table.finish()
    return Part(name.replace("_", " "), link, frame, start, end, radius_mm)


def _housing(probe: Probe, T_FS: FloatArray) -> tuple[Part, Part]:
    """Return two capsules, the front one and the rear one, that together cover the probe's housing."""
    x, y, z = probe.body_mm
    half_diagonal = hypot(x / 2, z / 4)
    radius_mm = _HOUSING_MARGIN * half_diagonal
    reach = max(y / 2 - sqrt(radius_mm**2 - half_diagonal**2), 0.0)
    front, rear = (
        Part(
            "probe",
            _PROBE_LINK,
            FLANGE_FRAME,
            T_FS[:3, :3] @ (0.0, -reach, -depth) + T_FS[:3, 3],
            T_FS[:3, :3] @ (0.0, reach, -depth) + T_FS[:3, 3],
            radius_mm,
        )
        for depth in (z / 4, 3 * z / 4)
    )
    return front, rear
