"""The bodies that move with the arm: links as capsules, the probe's housing as a box, and the probe's beam."""

from pathlib import Path
from typing import NamedTuple

import numpy as np

from planner.arrays import FloatArray
from planner.cell.cell import Probe
from planner.errors import ScanFileError
from protocol.files.toml_table import TomlTable

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
"""Link and frame of each part; a file has one or several capsules for each."""
_MOUNT_DEPTH = 0.75
"""Position at which the mount meets the housing, in depths of the housing from the laser's exit."""


class Part(NamedTuple):
    """A part of the arm or of the probe's mount: a capsule that moves with one frame of the arm.

    Attributes:
        name: its name in reasons.
        link: its place in the chain of bodies. Parts of one link or of neighboring links are not checked against each
            other.
        frame: the frame that it moves with: 0 the base, 1 to 6 the frame after each joint.
        start_mm: `(3,)`, one end of its segment in that frame.
        end_mm: `(3,)`, the other end.
        radius_mm: radius of the capsule.
    """

    name: str
    link: int
    frame: int
    start_mm: FloatArray
    end_mm: FloatArray
    radius_mm: float


class Housing(NamedTuple):
    """The probe's housing: a box that moves with the flange. It is the last link of the chain of bodies.

    Attributes:
        name: its name in reasons.
        link: its place in the chain.
        T_FH: `(4, 4)`, its middle and its axes in the frame of the flange.
        half_mm: `(3,)`, half its lengths along these axes.
    """

    name: str
    link: int
    T_FH: FloatArray
    half_mm: FloatArray


class Beam(NamedTuple):
    """The probe's beam: a capsule from the probe's origin along its z axis, which ends `gap_mm` before the surface."""

    radius_mm: float
    gap_mm: float


class Bodies(NamedTuple):
    """All bodies that move with the arm."""

    parts: tuple[Part, ...]
    housing: Housing
    beam: Beam


def shipped_bodies() -> list[str]:
    """Return the names of the arms with shipped bodies."""
    return sorted(file.stem for file in _SHIPPED.glob("*.toml"))


def load_bodies(probe: Probe, T_FS: FloatArray, file: Path | str = "viper_s650") -> Bodies:
    """Return the arm's parts from a TOML file, or of a shipped arm by its name, together with the probe's.

    Args:
        probe: the probe.
        T_FS: `(4, 4)`, the probe in the flange's frame, in mm.
        file: the file, or the name.

    Raises:
        ScanFileError: the file cannot be read, or a key is missing, unknown or of the wrong type.
    """
    shipped = _SHIPPED / f"{file}.toml"
    top = TomlTable.load(shipped if shipped.is_file() else Path(file), ScanFileError)
    parts = [
        _read_part(table, name, link, frame)
        for name, (link, frame) in _ARM_PARTS.items()
        for table in top.one_or_more(name)
    ]
    mount = top.table("probe_mount")
    rear = (T_FS @ (0.0, 0.0, -_MOUNT_DEPTH * probe.body_mm[2], 1.0))[:3]
    radius_mm = mount.number("radius_mm", above=0.0)
    parts.append(Part("probe mount", WRIST_LINK, FLANGE_FRAME, np.zeros(3), rear, radius_mm))
    beam_table = top.table("beam")
    beam = Beam(beam_table.number("radius_mm", above=0.0), beam_table.number("gap_mm", at_least=0.0))
    for table in (mount, beam_table, top):
        table.finish()
    return Bodies(tuple(parts), _housing(probe, T_FS), beam)


def _read_part(table: TomlTable, name: str, link: int, frame: int) -> Part:
    start, end = (np.array(table.numbers(key, 3)) for key in ("start_mm", "end_mm"))
    radius_mm = table.number("radius_mm", above=0.0)
    table.finish()
    return Part(name.replace("_", " "), link, frame, start, end, radius_mm)


def _housing(probe: Probe, T_FS: FloatArray) -> Housing:
    """Return the probe's housing, which ends at the laser's exit."""
    T_SH = np.eye(4)
    T_SH[2, 3] = -probe.body_mm[2] / 2
    return Housing("probe", _PROBE_LINK, T_FS @ T_SH, np.array(probe.body_mm) / 2)
