"""The keys of scan, arm and bodies files, from the planner's readers, applied to files that have every key."""

import re
from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import fields
from functools import partial
from inspect import cleandoc
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import trimesh

from planner.arrays import FloatArray
from planner.cell.bodies import load_bodies
from planner.cell.cell import Cell, Probe
from planner.cell.patterns import PATTERNS, StripLayout
from planner.cell.scan import load_scan
from planner.cell.workpiece import CLASSES
from planner.kinematics.arm import Arm
from planner.kinematics.value import FACTORS, ValueFunction
from tools.reference.keys import Key, key_page
from tools.reference.recorded_keys import recorded_keys

_BOUNDS = "A bound that depends on another key is shown for that key's default."
_SCAN = f"""A scan file describes cell, workpiece, path, value function, limits and weights. Files that it names
are relative to its folder. Lengths are in mm and angles in degrees. A placement is
`[x, y, z, yaw, pitch, roll]`, as Rz(yaw) Ry(pitch) Rz(roll). {_BOUNDS} `python -m planner new-scan` writes
a scan file for a mesh."""
_ARM = """The file that `cell.arm` names: the standard Denavit-Hartenberg table of a six-axis arm with a spherical
wrist. There are six `[[joint]]` sections. Angles, limits and speeds are the ones that the robot's controller shows."""
_BODIES = """The file that `cell.bodies` names: the collision bodies that move with the arm. Each part of the arm is one
capsule, `[part]`, or several, `[[part]]`. A capsule is all points within a radius of a segment."""

_DIMENSIONS = {
    "diameter_mm": 100,
    "length_mm": 200,
    "width_mm": 150,
    "height_mm": 80,
    "cavity_length_mm": 140,
    "cavity_width_mm": 100,
    "cavity_depth_mm": 40,
}
"""Dimensions of a workpiece of any class."""

_PATH = "time_step_s = 2\nscan_speed_mm_s = 100\n"
_PLACEMENTS = """table_in_base = [570, 0, 120, 0, 0, 0]
workpiece_on_table = [0, 0, 0, 0, 0, 0]
probe_on_flange = [0, 0, 100, 0, 0, 0]
"""


def planner_pages() -> dict[str, str]:
    """Return the pages of scan, arm and bodies files, by file name."""
    return {
        "keys-scan.md": key_page("Keys of a scan", _SCAN, scan_keys()),
        "keys-arm.md": key_page("Keys of an arm", _ARM, arm_keys()),
        "keys-bodies.md": key_page("Keys of bodies", _BODIES, bodies_keys()),
    }


def scan_keys() -> list[Key]:
    """Return every key of a scan file, section by section."""
    found: dict[str, Key] = {}
    read_by: Counter[str] = Counter()
    with TemporaryDirectory() as folder:
        files = write_scans(Path(folder))
        for file in files:
            asked = recorded_keys(partial(load_scan, file))
            for name, key in ((name, key) for (of, name), key in asked.items() if of == file):
                found[name] = _widest(found.get(name), key)
                read_by[name] += 1
    for name, key in found.items():
        if key.default is None and read_by[name] < len(files):
            found[name] = key._replace(default="")  # required in some scans only: the notes state which
    sections = list(dict.fromkeys(name.rpartition(".")[0] for name in found))
    ordered = sorted(found.values(), key=lambda key: sections.index(key.name.rpartition(".")[0]))
    return _with_meanings(ordered)


def arm_keys() -> list[Key]:
    """Return every key of an arm file."""
    return _with_meanings(recorded_keys(Arm.load).values())


def bodies_keys() -> list[Key]:
    """Return every key of a bodies file."""
    T_FS = Cell().T_FS
    return _with_meanings(recorded_keys(lambda: load_bodies(Probe(), T_FS)).values())


def write_scans(folder: Path) -> list[Path]:
    """Write scan files that together have every key of a scan, and return them."""
    box = trimesh.creation.box((100.0, 80.0, 60.0))
    box.apply_translation((0.0, 0.0, 30.0))
    box.export(folder / "part.stl")
    (folder / "path.csv").write_text("200,0,30,0,-90,0\n0,200,30,90,-90,0\n", encoding="utf-8")
    texts = {
        kind: f'[workpiece]\nclass = "{kind}"\n{_dimensions(kind)}[path]\npattern = "{min(PATTERNS[kind])}"\n{_PATH}'
        for kind in CLASSES
    }
    mesh = '[workpiece]\nmesh = "part.stl"\nunit = "mm"\n'
    texts["mesh"] = f'{mesh}class = "cylinder"\n[path]\npattern = "rings"\n{_PATH}'
    cell = f'[cell]\narm = "viper_s650"\nbodies = "viper_s650"\n{_PLACEMENTS}'
    texts["path"] = f'{cell}{mesh}class = "other"\n[path]\nfile = "path.csv"\ntime_step_s = 2\n'
    for name, text in texts.items():
        (folder / f"{name}.toml").write_text(text, encoding="utf-8")
    return [folder / f"{name}.toml" for name in texts]


def _dimensions(kind: str) -> str:
    names = [item.name for item in fields(CLASSES[kind]) if item.name != "middle_mm"]
    return "".join(f"{name} = {_DIMENSIONS[name]}\n" for name in names)


def _widest(known: Key | None, key: Key) -> Key:
    """Return the one of two readings of a key that allows more: a mesh has more classes and patterns."""
    return key if known is None or len(key.allowed) > len(known.allowed) else known


def _with_meanings(keys: Iterable[Key]) -> list[Key]:
    return [key._replace(notes=meaning(key.name)) for key in keys]


def meaning(name: str) -> str:
    """Return the meaning of a key: from the docstring of its class, or from `_MEANINGS`.

    Raises:
        KeyError: neither has it.
    """
    last = name.rpartition(".")[2]
    text = _MEANINGS.get(name) or _MEANINGS.get(last) or _attributes()[last]
    return text[0].lower() + text[1:].removesuffix(".")


def _attributes() -> Mapping[str, str]:
    """Return the `Attributes:` of the classes for a file's values, each on one line."""
    found: dict[str, str] = {}
    for kind in (StripLayout, ValueFunction, Probe, Arm):
        section = cleandoc(kind.__doc__ or "").partition("Attributes:\n")[2].partition("\n\n")[0]
        found |= {entry[1]: " ".join(entry[2].split()) for entry in _ATTRIBUTE.finditer(section)}
    return found


_ATTRIBUTE = re.compile(r"^ {4}(\w+): (.*(?:\n {5,}.*)*)", re.MULTILINE)


def _xyz(pose: FloatArray) -> str:
    """Return a placement without rotation as a scan file writes it."""
    assert (pose[:3, :3] == np.eye(3)).all()
    x, y, z = pose[:3, 3]
    return f"`[{x:g}, {y:g}, {z:g}, 0, 0, 0]`"


_CELL = Cell()
_MEANINGS = {
    "arm": "a shipped arm, or the file of one: see the keys of an arm",
    "bodies": "a shipped arm, or the file of its collision bodies: see the keys of bodies (default: as `arm`)",
    "table_in_base": "the table in the frame of the arm's base: the middle of its top, its axis along z; "
    f"default: {_xyz(_CELL.T_BT)}",
    "workpiece_on_table": f"the workpiece on the table, at table angle 0; default: {_xyz(_CELL.T_TW)}",
    "probe_on_flange": "the probe on the arm's flange: the laser's exit, the beam along z; "
    f"default: {_xyz(_CELL.T_FS)}",
    "cell.table.radius_mm": "radius of the table's disc; no workpiece may extend beyond it",
    "thickness_mm": "thickness of the disc",
    "plinth_radius_mm": "radius of the base under the disc",
    "class": "class of the workpiece; required without a mesh; with a mesh, the dimensions are measured",
    "mesh": "an STL, PLY or OBJ file with a closed surface, in place of dimensions",
    "unit": "unit of length in the mesh file (default: mm; a mesh that is too small or too large for it is refused)",
    "diameter_mm": "diameter of a sphere or a cylinder",
    "length_mm": "length along x of a block or a mould",
    "width_mm": "width along y of a block or a mould",
    "height_mm": "height along z of any class but the sphere",
    "cavity_length_mm": "length of the cavity, below the length",
    "cavity_width_mm": "width of the cavity, below the width",
    "cavity_depth_mm": "depth of the cavity, below the height",
    "time_step_s": "time from one location to the next",
    "file": "a CSV or JSON file of poses, in place of a pattern",
    "pattern": "pattern of the path; required without a path file; without a mesh, one of the class of the workpiece",
    "scan_speed_mm_s": "speed of the laser line over the surface; required with a pattern",
    "table_speed_deg_s": "maximum speed of the table",
    "table_acceleration_deg_s2": "maximum acceleration of the table",
    "k_a": "weight of the squared acceleration in Eq. (5)",
    "k_w": "weight of the squared speed in Eq. (5)",
    "user_factors": "names of installed plug-in factors",
    "limits_deg": "lower and upper joint limit",
    "start_mm": "one end of the capsule's segment",
    "end_mm": "the other end",
    "radius_mm": "radius of the capsule",
    "gap_mm": "distance from the end of the checked beam to the surface",
    **{name: f"whether the factor {name} of the value function counts" for name in FACTORS},
}
"""Meanings that no docstring states, by full name or by the last part of it."""
