"""Detect lengths or angles of a scan that may be in another unit, for a scan in which nothing can be reached.

Nothing is refused because of it: a placement of 2 mm may be intended. A wrong unit is the likely cause when every cell
is forbidden.
"""

from collections.abc import Iterator

import numpy as np
from scipy.spatial.transform import Rotation

from planner.arrays import FloatArray
from planner.cell.scan import Scan

# Placements of a cell and paths around a part are longer than this in mm, and shorter in meters.
_SHORT_MM = 5.0
# In degrees these rotations are unusual; in radians they are quarter and half turns.
_QUARTER_RAD, _NEAR = np.pi / 4.0, 2e-3
# The beam directions of a path around a part differ by more than this.
_ALIKE_DEG = 10.0


def unit_hint(scan: Scan) -> str | None:
    """Return one sentence that names the values that may be meters or radians, or None."""
    found = list(_suspects(scan))
    return "; ".join(found) + "? Lengths are in mm and angles in deg." if found else None


def _suspects(scan: Scan) -> Iterator[str]:
    cell = scan.cell
    for key, T in (
        ("cell.table_in_base", cell.T_BT), ("cell.workpiece_on_table", cell.T_TW), ("cell.probe_on_flange", cell.T_FS),
    ):  # fmt: skip
        length_mm = float(np.linalg.norm(T[:3, 3]))
        if 0.0 < length_mm < _SHORT_MM:
            yield f"{key} is {length_mm:.3g} mm long: is it in meters"
        turn_deg = _turns_deg(T[np.newaxis])[0]
        if turn_deg > 0.1 and abs(turn_deg / _QUARTER_RAD - round(turn_deg / _QUARTER_RAD)) < _NEAR:
            yield f"{key} turns by {turn_deg:.4f} deg: is it in radians"
    positions = scan.path.T_WS[:, :3, 3]
    reach_mm = float(np.linalg.norm(positions - positions.mean(axis=0), axis=1).max())
    if reach_mm < _SHORT_MM and reach_mm < 0.1 * float(np.max(scan.mesh.extents)):
        yield f"all poses of the path are within {reach_mm:.3g} mm: is it in meters"
    turns_deg = _turns_deg(scan.path.T_WS)
    if 0.0 < turns_deg.max() < _ALIKE_DEG:
        yield f"no pose of the path turns by more than {turns_deg.max():.3g} deg: is it in radians"


def _turns_deg(T: FloatArray) -> FloatArray:
    """Return the rotation angle of each pose `(n, 4, 4)`."""
    return np.asarray(np.degrees(Rotation.from_matrix(T[:, :3, :3]).magnitude()))
