"""Check that the beam meets the part.

Typical errors of a path file are a wrong frame, a wrong unit, or a wrong beam direction.
"""

from typing import NamedTuple

import numpy as np
import trimesh

from planner.arrays import BoolArray, FloatArray
from planner.cell.cell import Probe
from planner.geometry.ray_casting import RayCaster

# Rays over the laser line: its middle may be over a hole.
_RAYS = 31


class BeamFaults(NamedTuple):
    """The result for the laser line at each location of a path `(n,)`.

    Attributes:
        away: no surface ahead, and the part behind.
        misses: no surface in either direction.
        beyond: a surface ahead, but none within the measuring range.
    """

    away: BoolArray
    misses: BoolArray
    beyond: BoolArray


def beam_faults(T_WS: FloatArray, mesh: trimesh.Trimesh, probe: Probe) -> BeamFaults:
    """Return the faults of the beam at each location `(n, 4, 4)` of a path over a mesh in mm."""
    rays = RayCaster(mesh)
    along_mm = np.linspace(-0.5, 0.5, _RAYS) * probe.line_width_mm
    starts = T_WS[:, np.newaxis, :3, 3] + along_mm[:, np.newaxis] * T_WS[:, np.newaxis, :3, 0]
    beams = np.repeat(T_WS[:, :3, 2], _RAYS, axis=0)
    shape = len(T_WS), _RAYS
    ahead_mm = rays.first_hits(starts.reshape(-1, 3), beams).distances_mm.reshape(shape)
    behind_mm = rays.first_hits(starts.reshape(-1, 3), -beams).distances_mm.reshape(shape)
    met = np.asarray(np.isfinite(ahead_mm).any(axis=1))
    in_range = np.asarray(((ahead_mm >= probe.nearest_mm) & (ahead_mm <= probe.farthest_mm)).any(axis=1))
    is_behind = np.asarray(np.isfinite(behind_mm).any(axis=1))
    return BeamFaults(away=~met & is_behind, misses=~met & ~is_behind, beyond=met & ~in_range)


def beam_warning(T_WS: FloatArray, mesh: trimesh.Trimesh, probe: Probe) -> str | None:
    """Return one sentence with the locations at which nothing can be measured, or None if there are none."""
    faults = beam_faults(T_WS, mesh, probe)
    ranged = f"meets the part outside the measuring range of {probe.nearest_mm:g} to {probe.farthest_mm:g} mm"
    found = [
        f"{what} at {_places(places)}"
        for what, places in (
            ("points away from the part", faults.away), ("misses the part", faults.misses), (ranged, faults.beyond),
        )
        if places.any()
    ]  # fmt: skip
    if not found:
        return None
    means = "; the beam is the +Z axis of a pose" if faults.away.any() else ""
    return f"the beam {', and '.join(found)}{means}"


def _places(places: BoolArray) -> str:
    count, total = int(places.sum()), len(places)
    first = int(np.flatnonzero(places)[0])
    return f"all {total} locations" if count == total else f"{count} of {total} locations (the first is {first})"
