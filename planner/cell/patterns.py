"""The predefined scanning patterns of Fig. 2, as waypoints of the probe over an idealized workpiece.

Each pattern is defined by corners in two or more coordinates of the surface (such as azimuth and height). Points are
filled in between, and placed on the surface. The distance of neighboring strips is line width x (1 - overlap).

| Fig. 2 | class    | patterns                                                  |
|--------|----------|-----------------------------------------------------------|
| (a)    | sphere   | meridians (zigzag), spiral                                |
| (b)    | cylinder | rings, helix; the line lies along the axis                |
| (c)    | mould    | raster (zigzag from above)                                |
| (d)    | mould    | crossed (two rasters), tilted (strips seen from two sides) |

A block has the patterns of a mould, on its top.
"""

import itertools
import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from planner.arrays import FloatArray
from planner.cell.cell import Probe
from planner.cell.scan_path import looking_at
from planner.cell.workpiece import Block, Cylinder, Mould, Sphere
from planner.errors import PathError

# Distance of the waypoints between corners, in mm, or in degrees of the coordinate that changes most.
_SPACING = 2.0
_MOST_STRIPS = 1000


@dataclass(frozen=True)
class StripLayout:
    """The layout of a pattern's strips.

    Attributes:
        overlap: share of the line's width that a strip has in common with its neighbor.
        top_polar_deg: start of a sphere's strips, as an angle from its pole.
        lowest_polar_deg: end of a sphere's strips; below its equator the table is in the way.
        bottom_margin_mm: minimum height of the line's middle above the base of a cylinder.
        wall_margin_mm: distance of the ends of the strips from the walls of a mould, so that the beam passes the wall.
        tilt_deg: tilt of the beam in the pattern `tilted`, to scan the walls.
    """

    overlap: float = 0.2
    top_polar_deg: float = 10.0
    lowest_polar_deg: float = 90.0
    bottom_margin_mm: float = 40.0
    wall_margin_mm: float = 15.0
    tilt_deg: float = 25.0

    def pitch_mm(self, line_width_mm: float) -> float:
        """Return the distance of neighboring strips."""
        return line_width_mm * (1.0 - self.overlap)

    def strip_centers(self, span_mm: float, line_width_mm: float) -> FloatArray:
        """Return the evenly spaced middles of the minimum number of strips that cover a span around 0."""
        beyond = max(0.0, span_mm - line_width_mm)
        count = 1 + strip_count(beyond, self.pitch_mm(line_width_mm))
        return np.linspace(-0.5 * beyond, 0.5 * beyond, count) if count > 1 else np.zeros(1)


def strip_count(span: float, pitch: float) -> int:
    """Return the number of strips of this pitch that cover a span.

    Raises:
        PathError: the number of strips is too large.
    """
    if not span < _MOST_STRIPS * pitch:
        raise PathError(
            f"the pattern has more than {_MOST_STRIPS:,} strips; check the probe's line_width_mm and the overlap"
        )
    return math.ceil(span / pitch - 1e-9)


def sphere_meridians(sphere: Sphere, probe: Probe, layout: StripLayout) -> FloatArray:
    """Return a zigzag down one meridian and up the next, with the line across the meridian."""
    radius = 0.5 * sphere.diameter_mm
    count = strip_count(2.0 * math.pi * radius, layout.pitch_mm(probe.line_width_mm))
    ends = (layout.top_polar_deg, layout.lowest_polar_deg)
    corners = [
        (polar, 360.0 * strip / count) for strip in range(count) for polar in (ends if strip % 2 == 0 else ends[::-1])
    ]
    polar, azimuth = np.radians(_filled(corners).T)
    across = np.column_stack((-np.sin(azimuth), np.cos(azimuth), np.zeros_like(azimuth)))
    return _on_sphere(sphere, probe, polar, azimuth, across)


def sphere_spiral(sphere: Sphere, probe: Probe, layout: StripLayout) -> FloatArray:
    """Return a spiral from the pole down by one strip per turn, with the line along the meridian.

    It starts and ends with a full turn at a constant polar angle; otherwise a wedge at each end would be missed.
    """
    turn_deg = math.degrees(layout.pitch_mm(probe.line_width_mm) / (0.5 * sphere.diameter_mm))
    top, lowest = layout.top_polar_deg, layout.lowest_polar_deg
    turns = (lowest - top) / turn_deg
    strip_count(turns, 1.0)
    corners = [(top, 0.0), (top, 360.0), (lowest, 360.0 * (turns + 1.0)), (lowest, 360.0 * (turns + 2.0))]
    polar, azimuth = np.radians(_filled(corners).T)
    down = np.column_stack((np.cos(polar) * np.cos(azimuth), np.cos(polar) * np.sin(azimuth), -np.sin(polar)))
    return _on_sphere(sphere, probe, polar, azimuth, down)


def _on_sphere(sphere: Sphere, probe: Probe, polar: FloatArray, azimuth: FloatArray, lines: FloatArray) -> FloatArray:
    normals = np.column_stack((np.sin(polar) * np.cos(azimuth), np.sin(polar) * np.sin(azimuth), np.cos(polar)))
    radius = 0.5 * sphere.diameter_mm
    points = np.add(sphere.middle_mm, (0.0, 0.0, radius)) + radius * normals
    return looking_at(points, normals, lines, probe.stand_off_mm)


def cylinder_rings(cylinder: Cylinder, probe: Probe, layout: StripLayout) -> FloatArray:
    """Return full turns at one height each, from the bottom up, always in the same direction."""
    heights = _ring_heights(cylinder, probe, layout)
    corners = [(360.0 * (ring + end), height) for ring, height in enumerate(heights) for end in (0.0, 1.0)]
    return _on_cylinder(cylinder, probe, corners)


def cylinder_helix(cylinder: Cylinder, probe: Probe, layout: StripLayout) -> FloatArray:
    """Return a helix from the bottom up by one strip per turn.

    It starts and ends with a full turn at a constant height; otherwise a wedge at each end would be missed.
    """
    heights = _ring_heights(cylinder, probe, layout)
    bottom, top, turns = heights[0], heights[-1], len(heights) - 1
    return _on_cylinder(
        cylinder, probe, [(0.0, bottom), (360.0, bottom), (360.0 * (turns + 1), top), (360.0 * (turns + 2), top)]
    )


def _ring_heights(cylinder: Cylinder, probe: Probe, layout: StripLayout) -> FloatArray:
    bottom = min(layout.bottom_margin_mm, 0.5 * cylinder.height_mm)
    lower = max(0.0, bottom - 0.5 * probe.line_width_mm)
    middles = layout.strip_centers(cylinder.height_mm - lower, probe.line_width_mm)
    return middles + 0.5 * (cylinder.height_mm + lower)


def _on_cylinder(cylinder: Cylinder, probe: Probe, corners: list[tuple[float, float]]) -> FloatArray:
    azimuth_deg, height = _filled(corners).T
    azimuth = np.radians(azimuth_deg)
    normals = np.column_stack((np.cos(azimuth), np.sin(azimuth), np.zeros_like(azimuth)))
    points = 0.5 * cylinder.diameter_mm * normals + cylinder.middle_mm
    points[:, 2] += height
    lines = np.tile((0.0, 0.0, 1.0), (len(points), 1))
    return looking_at(points, normals, lines, probe.stand_off_mm)


class Floor(NamedTuple):
    """A level rectangle for strips; its length is along x, its width along y.

    Attributes:
        length_mm: length of the middles of the strips along x.
        width_mm: extent of the strips along y, including half of the line on each side.
        middle_mm: its middle.
    """

    length_mm: float
    width_mm: float
    middle_mm: FloatArray


def floor_of(workpiece: Mould | Block, layout: StripLayout) -> tuple[Floor, Floor]:
    """Return the rectangles for strips along x and along y: a mould's cavity, or the whole top of a block."""
    if isinstance(workpiece, Block):
        top = Floor(workpiece.length_mm, workpiece.width_mm, np.add(workpiece.middle_mm, (0, 0, workpiece.height_mm)))
        return top, top._replace(length_mm=top.width_mm, width_mm=top.length_mm)
    length_mm, width_mm = workpiece.cavity_length_mm, workpiece.cavity_width_mm
    middle_mm = np.add(workpiece.middle_mm, (0.0, 0.0, workpiece.height_mm - workpiece.cavity_depth_mm))
    margins_mm = 2.0 * layout.wall_margin_mm
    return (
        Floor(max(0.0, length_mm - margins_mm), width_mm, middle_mm),
        Floor(max(0.0, width_mm - margins_mm), length_mm, middle_mm),
    )


def raster(workpiece: Mould | Block, probe: Probe, layout: StripLayout) -> FloatArray:
    """Return a zigzag of strips along the length, from vertically above."""
    along, _ = floor_of(workpiece, layout)
    return _on_floor(along, probe, _strips(along, probe, layout))


def crossed(workpiece: Mould | Block, probe: Probe, layout: StripLayout) -> FloatArray:
    """Return the raster along the length, then one across it with the line rotated by 90 degrees."""
    floor, across = floor_of(workpiece, layout)
    along = _strips(floor, probe, layout)
    crossing = [(-y, x, 90.0, tilt) for x, y, _, tilt in _strips(across, probe, layout)]
    return _on_floor(floor, probe, along + _from_nearer_end(crossing, along[-1]))


def tilted(workpiece: Mould | Block, probe: Probe, layout: StripLayout) -> FloatArray:
    """Return the raster with the beam tilted to one side of the travel, then back with it tilted to the other."""
    floor, _ = floor_of(workpiece, layout)
    strips = _strips(floor, probe, layout)
    leaning = [(x, y, turn, layout.tilt_deg) for x, y, turn, _ in strips]
    back = [(x, y, turn, -layout.tilt_deg) for x, y, turn, _ in reversed(strips)]
    return _on_floor(floor, probe, leaning + back)


FloorCorner = tuple[float, float, float, float]
"""Position on the floor (x, y in mm), rotation of the line around z, and tilt of the beam across it (deg)."""


def _strips(floor: Floor, probe: Probe, layout: StripLayout) -> list[FloorCorner]:
    ends = (-0.5 * floor.length_mm, 0.5 * floor.length_mm)
    middles = layout.strip_centers(floor.width_mm, probe.line_width_mm)
    return [
        (x, float(y), 0.0, 0.0) for strip, y in enumerate(middles) for x in (ends if strip % 2 == 0 else ends[::-1])
    ]


def _from_nearer_end(corners: list[FloorCorner], start: FloorCorner) -> list[FloorCorner]:
    first, last = (math.dist(corners[end][:2], start[:2]) for end in (0, -1))
    return corners if first <= last else corners[::-1]


def _on_floor(floor: Floor, probe: Probe, corners: list[FloorCorner]) -> FloatArray:
    x, y, turn_deg, tilt_deg = _filled(corners).T
    turn, tilt = np.radians(turn_deg), np.radians(tilt_deg)
    # Without tilt and rotation, the strip is along x and the line along y.
    lines = np.column_stack((-np.sin(turn), np.cos(turn), np.zeros_like(turn)))
    normals = np.sin(tilt)[:, np.newaxis] * lines + np.cos(tilt)[:, np.newaxis] * np.array([0.0, 0.0, 1.0])
    points = np.column_stack((x, y, np.zeros_like(x))) + floor.middle_mm
    return looking_at(points, normals, lines, probe.stand_off_mm)


PATTERNS: dict[str, dict[str, Callable[..., FloatArray]]] = {
    "block": {"crossed": crossed, "raster": raster, "tilted": tilted},
    "cylinder": {"helix": cylinder_helix, "rings": cylinder_rings},
    "mould": {"crossed": crossed, "raster": raster, "tilted": tilted},
    "sphere": {"meridians": sphere_meridians, "spiral": sphere_spiral},
}
"""The patterns of each workpiece class, by name. Each takes the workpiece, the probe and the layout."""


def _filled(corners: list[tuple[float, ...]] | list[FloorCorner] | list[tuple[float, float]]) -> FloatArray:
    """Return the corners with evenly spaced points between them, `(n, number of coordinates)`."""
    pieces = [np.array(corners[:1], dtype=np.float64)]
    for start, end in itertools.pairwise(corners):
        longest = max(abs(b - a) for a, b in zip(start, end, strict=True))
        steps = max(1, math.ceil(longest / _SPACING))
        pieces.append(np.linspace(start, end, steps + 1)[1:])
    return np.concatenate(pieces)
