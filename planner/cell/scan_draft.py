"""A draft scan of a new mesh: the assumptions about it, as a scan and as the text of a scan file."""

import json
import math
import os
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import trimesh

from planner.cell.bodies import load_bodies
from planner.cell.cell import Cell, placement
from planner.cell.mesh_path import CLASS_OF_PATTERN, class_of, measured, mesh_waypoints
from planner.cell.part_class import PartClass, part_class
from planner.cell.patterns import StripLayout
from planner.cell.scan import DEFAULT_ARM, Scan, check_it_fits_the_table
from planner.cell.scan_path import ScanPath, at_scan_speed
from planner.errors import PlannerError
from planner.kinematics.arm import Arm
from planner.kinematics.value import ValueFunction
from planner.table.cost import default_weights
from planner.table.motion import Limits
from protocol.program.command_line import program_name

TURN_TO_UP = {
    "z": (0.0, 0.0, 0.0),
    "-z": (0.0, 180.0, 0.0),
    "x": (0.0, -90.0, 0.0),
    "-x": (0.0, 90.0, 0.0),
    "y": (0.0, -90.0, -90.0),
    "-y": (0.0, -90.0, 90.0),
}
"""Yaw, pitch and roll in degrees that rotate an axis of a mesh file upward."""

FIRST_PATTERN = {"block": "raster", "cylinder": "rings", "mould": "raster", "sphere": "meridians"}

_FASTEST_MM_S = 30.0
# The table has to compensate the rotation of a ring; its limit is 40 deg/s.
_FASTEST_RAD_S = math.radians(23.0)
_STEP_S, _SHORTEST_STEP_S, _LONGEST_STEP_S = 0.5, 0.2, 1.2
_FEWEST, _MOST = 40, 250  # locations: fewer leave gaps between samples of the map, more take long to plan
_BOTTOM_MARGINS_MM = 60.0, 90.0, 120.0, 150.0
_POLAR_ENDS_DEG = 85.0, 65.0, 45.0


@dataclass(frozen=True)
class Part:
    """A mesh and its placement.

    Attributes:
        mesh: its surface in the frame of its file, in mm.
        file: its file.
        unit: unit of the file, one of `MILLIMETERS`.
        up: axis of the file that points up, one of `TURN_TO_UP`.
    """

    mesh: trimesh.Trimesh
    file: Path
    unit: str = "mm"
    up: str = "z"

    @property
    def placement(self) -> tuple[float, ...]:
        """The placement on the table, x y z yaw pitch roll.

        The part's middle is on the axis, its lowest point on the top.
        """
        turned = np.asarray(self.mesh.vertices) @ placement(0.0, 0.0, 0.0, *TURN_TO_UP[self.up])[:3, :3].T
        lower, upper = turned.min(axis=0), turned.max(axis=0)
        x, y = -0.5 * (lower + upper)[:2]
        return (*(round(float(value), 3) + 0.0 for value in (x, y, -lower[2])), *TURN_TO_UP[self.up])

    @property
    def cell(self) -> Cell:
        """The default cell with the part on its table."""
        return Cell(arm=Arm.load(DEFAULT_ARM), T_TW=placement(*self.placement))

    @property
    def kind(self) -> PartClass:
        """The class that is nearest to the part in this orientation."""
        standing = self.mesh.copy()
        standing.apply_transform(placement(*self.placement))
        return part_class(standing)


@dataclass(frozen=True)
class Draft:
    """A scan of a part: a pattern with its keys.

    Attributes:
        part: the part.
        kind: its class.
        pattern: the pattern of that class.
        keys: keys of `[path]` that differ from their defaults, by name.
        speed_mm_s: speed of the line over the surface.
        step_s: time from one location to the next.
    """

    part: Part
    kind: str
    pattern: str
    keys: tuple[tuple[str, float], ...]
    speed_mm_s: float
    step_s: float

    def path(self) -> ScanPath:
        """Return the path.

        Raises:
            PlannerError: the pattern cannot be applied to the part.
        """
        cell, layout = self.part.cell, StripLayout(**dict(self.keys))
        waypoints = mesh_waypoints(self.part.mesh, self.kind, self.pattern, cell.T_TW, cell.probe, layout)
        return at_scan_speed(waypoints, self.speed_mm_s, self.step_s, cell.probe.stand_off_mm, cell.probe.line_width_mm)

    def scan(self, name: str) -> Scan:
        """Return the scan described by `text`.

        Raises:
            PlannerError: the pattern cannot be applied to the part, or the part does not fit the table.
        """
        cell, limits = self.part.cell, Limits()
        check_it_fits_the_table(self.part.mesh, cell)
        return Scan(
            name,
            cell,
            load_bodies(cell.probe, cell.T_FS, DEFAULT_ARM),
            measured(self.part.mesh, self.kind, cell.T_TW)[0],
            self.part.mesh,
            self.part.file,
            self.path(),
            ValueFunction(),
            limits,
            default_weights(limits),
        )

    def text(self, folder: Path) -> str:
        """Return the text of the commented scan file, for a folder."""
        part, cell, limits = self.part, self.part.cell, Limits()
        mesh = json.dumps(_relative(part.file.resolve(), folder.resolve()).as_posix())
        x, y, z = (float(side) for side in part.mesh.extents)
        unit = [] if part.unit == "mm" else [("unit", json.dumps(part.unit), "of the lengths in the mesh file")]
        sections: dict[str, list[tuple[str, str, str]]] = {
            "cell": [
                ("arm", json.dumps(DEFAULT_ARM), "the cell of the shipped scans, an estimate: enter your cell here"),
                ("table_in_base", _list(*cell.T_BT[:3, 3], 0, 0, 0), "middle of the table top, its axis upright"),
                ("probe_on_flange", _list(*cell.T_FS[:3, 3], 0, 0, 0), "the beam continues the axis of joint 6"),
                ("workpiece_on_table", _list(*part.placement), "middle on the table's axis, lowest point on the top"),
            ],
            "cell.probe": [
                ("stand_off_mm", f"{cell.probe.stand_off_mm:g}", "from the laser's exit to the surface"),
                ("nearest_mm", f"{cell.probe.nearest_mm:g}", "start of the measuring range"),
                ("farthest_mm", f"{cell.probe.farthest_mm:g}", "end of the measuring range"),
                ("line_width_mm", f"{cell.probe.line_width_mm:g}", "width of the laser line at the stand-off"),
            ],
            "workpiece": [
                ("mesh", mesh, "path relative to this file"),
                *unit,
                ("class", json.dumps(self.kind), _CLASSES),
            ],
            "path": [
                ("pattern", json.dumps(self.pattern), f"or {', '.join(sorted({*CLASS_OF_PATTERN} - {self.pattern}))}"),
                ("overlap", f"{StripLayout.overlap:g}", "share of the line that neighboring strips have in common"),
                *((name, f"{value:g}", _KEYS[name]) for name, value in self.keys),
                ("scan_speed_mm_s", f"{self.speed_mm_s:g}", "speed of the line over the surface"),
                ("time_step_s", f"{self.step_s:g}", "time from one location to the next"),
            ],
            "limits": [
                ("table_speed_deg_s", f"{limits.speed_deg_s:g}", "maximum speed of the table"),
                ("table_acceleration_deg_s2", f"{limits.acceleration_deg_s2:g}", "maximum acceleration of the table"),
            ],
        }
        head = _HEAD.format(planner=program_name("planner"), mesh=mesh, size=f"{x:.1f} x {y:.1f} x {z:.1f}")
        return head + "".join(_section(name, rows) for name, rows in sections.items())


_CLASSES = "block, cylinder, mould or sphere: the shape that patterns are laid on"
_KEYS = {
    "bottom_margin_mm": "minimum height of the line's middle: below it the probe would touch the table",
    "lowest_polar_deg": "end of the strips, from the pole: lower down the table is in the way",
    "wall_margin_mm": "distance of the strips' ends from the walls",
}
_HEAD = """\
# A scan of {mesh}, {size} mm, written by `{planner} new-scan`.
# Lengths in mm, angles in deg; placements are x y z yaw pitch roll (ZYZ, as in the robot language).
# In place of a pattern, [path] takes file = "path.csv". Patterns and path files: docs/own-part.md.
"""
_COMMENT_COLUMN = 46


def _section(name: str, rows: list[tuple[str, str, str]]) -> str:
    """Return a table of a TOML file: one line for each key, value and comment."""
    lines = [f"{key} = {value}".ljust(_COMMENT_COLUMN) + f"  # {comment}" for key, value, comment in rows]
    return "\n".join(("", f"[{name}]", *lines, ""))


def drafts(part: Part, kind: str | None = None, pattern: str | None = None) -> Iterator[Draft]:
    """Yield scans of a part, best fit first; `kind` and `pattern` are the requested values, if any.

    Raises:
        PlannerError: the requested pattern cannot be applied to the part.
    """
    first = kind or part.kind.kind
    if pattern is not None:
        kinds = [(class_of(first, pattern), pattern)]
    else:
        kinds = [(first, FIRST_PATTERN[first])]
        if kind is None:
            # Every part can be scanned from above in some way.
            kinds += [(other, FIRST_PATTERN[other]) for other in ("block", "cylinder", "sphere") if other != first]
    for each, laid in kinds:
        for keys in _layouts(each, part):
            try:
                yield _timed(Draft(part, each, laid, keys, _speed_mm_s(part), _STEP_S))
            except PlannerError:
                if kind is not None or pattern is not None:
                    raise


def _layouts(kind: str, part: Part) -> Iterator[tuple[tuple[str, float], ...]]:
    if kind == "cylinder":
        height_mm = float(np.ptp(np.asarray(part.mesh.vertices) @ part.cell.T_TW[2, :3]))
        margins = [margin for margin in _BOTTOM_MARGINS_MM if margin < height_mm] or [_BOTTOM_MARGINS_MM[0]]
        yield from ((("bottom_margin_mm", margin),) for margin in margins)
    elif kind == "sphere":
        yield from ((("lowest_polar_deg", polar),) for polar in _POLAR_ENDS_DEG)
    elif kind == "mould":
        yield (("wall_margin_mm", 15.0),)
    else:
        yield ()


def _speed_mm_s(part: Part) -> float:
    """Return a speed at which the table can compensate a rotation around the part."""
    length_mm, width_mm = np.ptp(np.asarray(part.mesh.vertices) @ part.cell.T_TW[:2, :3].T, axis=0)
    return float(f"{min(_FASTEST_MM_S, _FASTEST_RAD_S * 0.25 * (length_mm + width_mm)):.2g}")


def _undone_by_the_table(draft: Draft) -> Draft:
    """Return the draft, slower if the beam turns about the vertical faster than the table can undo it.

    That is so where a ring is narrower than the part, as at the top of a cone.
    """
    if draft.kind != "cylinder":  # other patterns can be scanned without a turn of the table
        return draft
    beams = draft.path().T_WS[:, :3, 2] @ draft.part.cell.T_TW[:2, :3].T
    turns_rad = np.abs(np.diff(np.unwrap(np.arctan2(beams[:, 1], beams[:, 0]))))
    slower = min(1.0, _FASTEST_RAD_S * draft.step_s / max(float(turns_rad.max(initial=0.0)), 1e-9))
    return replace(draft, speed_mm_s=float(f"{slower * draft.speed_mm_s:.2g}"))


def _timed(draft: Draft) -> Draft:
    """Return the draft with a time step, and a lower speed if necessary, for a moderate number of locations."""
    draft = _undone_by_the_table(draft)
    duration_s = (draft.path().count - 1) * draft.step_s
    step_s = min(max(_STEP_S, duration_s / _MOST), _LONGEST_STEP_S, max(duration_s / _FEWEST, _SHORTEST_STEP_S))
    slower = min(1.0, duration_s / (_FEWEST * step_s))
    return replace(draft, step_s=float(f"{step_s:.2g}"), speed_mm_s=float(f"{slower * draft.speed_mm_s:.2g}"))


def _relative(file: Path, folder: Path) -> Path:
    """Return the relative path from a folder to a file, or the absolute path if there is none (two drives)."""
    try:
        return Path(os.path.relpath(file, folder))
    except ValueError:
        return file


def _list(*numbers: float) -> str:
    return f"[{', '.join(f'{number:.10g}' for number in numbers)}]"
