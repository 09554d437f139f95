"""The second placement of a part: laid on another face, scanned again, and both clouds joined.

A part is laid by hand, so its second pose is only about the drawn one; the overlap of the clouds determines it. Where
it does not, both clouds stay as they are, each in the frame of its own placement.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import trimesh

from planner.adaptive.adaptive_scan import AdaptiveScanned, AdaptOptions, scan_adaptively
from planner.adaptive.other_face import other_face
from planner.adaptive.registration import Joined, join
from planner.adaptive.registration_cloud import Cloud
from planner.adaptive.visibility import Places, at_nearest
from planner.arrays import BoolArray, FloatArray
from planner.cell.cell import placement
from planner.cell.scan import Scan, check_it_fits_the_table
from planner.geometry.thinned_cloud import ThinnedCloud
from planner.geometry.transforms import rigid_inverse
from planner.scanning.error_budget import signed_distances_mm
from planner.scanning.point_cloud import PlyWriter, read_cloud
from planner.scanning.probe import Sight
from planner.scanning.scan_run import CLOUD_FILE, ScanOptions, write_surface
from protocol.program.progress import ProgressOf

TURNED_FOLDER, JOINED_FILE = "turned", "joined.ply"
_CELL_MM = 1.0
"""Of the thinned clouds that are joined."""
_LAID_MM, _LAID_DEG = 0.3, 0.2
"""How far off the drawing a simulated hand lays the part, 1 sigma of each axis."""
_COMPARED = 20_000
"""Points of each cloud whose distance from the mesh is looked at."""


@dataclass(frozen=True, eq=False)
class TurnedOver:
    """What two placements came to.

    Attributes:
        first: The part as it stood.
        second: The part on another face.
        joined: The pose of the second cloud in the frame of the first, or why the overlap does not determine it.
        seen: `(m,)` which places of the first coverage were seen in either placement.
        visible: `(m,)` which can be seen in either.
        first_mm: Mean distance of the first cloud from the mesh, without sign.
        second_mm: The same of the second cloud, in its own frame.
        joined_mm: The same of both together; None where they are not joined.
    """

    first: AdaptiveScanned
    second: AdaptiveScanned
    joined: Joined | str
    seen: BoolArray
    visible: BoolArray
    first_mm: float
    second_mm: float
    joined_mm: float | None


def scan_turned_over(
    first: AdaptiveScanned,
    scan: Scan,
    known: Scan,
    options: ScanOptions,
    adapt: AdaptOptions,
    out: Path,
    progress: ProgressOf,
    say: Callable[[int, str], None],
) -> TurnedOver:
    """Lay the part of a scan on another face, scan it again, and join the clouds.

    Args:
        first: The scan of the part as it stood, whose results are in `out`.
        scan: What was scanned.
        known: The same with the mesh that the face and the strips are chosen by.
        options: How it is scanned.
        adapt: What is wanted.
        out: Where the joined cloud is written; the second scan goes to its subfolder.
        progress: See `scan_adaptively`.
        say: See `scan_adaptively`.

    Raises:
        PlannerError: The part stands on no other face, or cannot be scanned there.
        TableError: The table does not answer.
        OSError: A folder cannot be written.
    """
    coverage = first.scanned.coverage
    unseen = Places(coverage.points[~first.visible], coverage.normals[~first.visible])
    T_21 = other_face(known.mesh, unseen)
    turned, laid = _moved(known, T_21), _moved(scan, _by_hand(options.seed) @ T_21)
    check_it_fits_the_table(turned.mesh, scan.cell)
    alone = options._replace(normals=False, surface=None)
    second = scan_adaptively(laid, alone, adapt, out / TURNED_FOLDER, progress, say, turned)
    clouds = read_cloud(out / CLOUD_FILE), read_cloud(out / TURNED_FOLDER / CLOUD_FILE)
    one, other = (Cloud.of(_thinned(_CELL_MM, cloud)) for cloud in clouds)
    joined = join(one, other, rigid_inverse(T_21))
    first_mm, second_mm = (
        _mean_mm(mesh_of.mesh, points) for mesh_of, (points, _) in zip((scan, laid), clouds, strict=True)
    )
    joined_mm = None
    if isinstance(joined, Joined):
        moved = clouds[1][0] @ joined.T_12[:3, :3].T + joined.T_12[:3, 3], clouds[1][1] @ joined.T_12[:3, :3].T
        _write(out / JOINED_FILE, scan.name, clouds[0], moved)
        if options.thinned_mm is not None:
            write_surface(_thinned(options.thinned_mm, clouds[0], moved), scan.name, options, out)
        shares = np.array((len(clouds[0][0]), len(moved[0])), dtype=np.float64)
        joined_mm = float(shares @ (first_mm, _mean_mm(scan.mesh, moved[0])) / shares.sum())
    seen, visible = _in_either(first, second, rigid_inverse(T_21))
    return TurnedOver(first, second, joined, seen, visible, first_mm, second_mm, joined_mm)


def turned_over_document(turned: TurnedOver) -> dict[str, Any]:
    """Return the second placement for `scan.json`."""
    document: dict[str, Any] = {
        "seen_of_whole": float(turned.seen.mean()),
        "seen_of_visible": float(turned.seen.sum() / max(1, turned.visible.sum())),
        "mean_distance_mm": {"first": turned.first_mm, "second": turned.second_mm, "joined": turned.joined_mm},
    }
    if isinstance(turned.joined, str):
        return document | {"refused": turned.joined}
    return document | {
        "T_12": turned.joined.T_12.tolist(),
        "overlap": turned.joined.overlap.share,
        "residual_mm": turned.joined.overlap.residual_mm,
        "uncertainty_mm": turned.joined.uncertainty_mm,
    }


def turned_over_summary(turned: TurnedOver) -> str:
    """Return what two placements came to, for people."""
    shares = (
        f"{turned.seen.sum() / max(1, turned.visible.sum()):.1%} of what can be seen in either placement,"
        f" {turned.seen.mean():.1%} of the whole surface"
    )
    if isinstance(turned.joined, str):
        return f"turn over  {shares}; the clouds are not joined: {turned.joined}\n"
    joined, overlap = turned.joined, turned.joined.overlap
    assert turned.joined_mm is not None
    return (
        f"turn over  {shares}; joined on an overlap of {overlap.share:.0%} with a residual of"
        f" {1e3 * overlap.residual_mm:.1f} micrometers (1 sigma), uncertainty {1e3 * joined.uncertainty_mm:.1f}\n"
        f"           mean distance from the mesh: {1e3 * turned.first_mm:.1f} micrometers as it stood,"
        f" {1e3 * turned.second_mm:.1f} turned over, {1e3 * turned.joined_mm:.1f} joined\n"
    )


def _moved(scan: Scan, T: FloatArray) -> Scan:
    """Return the scan of the part at another pose, without a predefined path."""
    mesh = scan.mesh.copy()
    mesh.apply_transform(T)
    return replace(scan, name=f"{scan.name}, turned over", workpiece=None, mesh=mesh, predefined_path=None)


def _by_hand(seed: int) -> FloatArray:
    """Return by how much a hand lays a part off: along the table and about its axis."""
    x, y, turn = np.random.default_rng((seed, 1)).standard_normal(3)
    return placement(_LAID_MM * x, _LAID_MM * y, 0.0, _LAID_DEG * turn, 0.0, 0.0)


def _thinned(cell_mm: float, *clouds: tuple[FloatArray, FloatArray]) -> ThinnedCloud:
    """Return clouds of points and beams as one thinned cloud."""
    thinned = ThinnedCloud(cell_mm)
    for points, beams in clouds:
        thinned.take(points, beams)
    return thinned


def _mean_mm(mesh: trimesh.Trimesh, points: FloatArray) -> float:
    """Return the mean distance of a cloud's points from a mesh, without sign."""
    some = points[:: max(1, len(points) // _COMPARED)]
    return float(np.abs(signed_distances_mm(mesh, some)).mean())


def _in_either(first: AdaptiveScanned, second: AdaptiveScanned, T_12: FloatArray) -> tuple[BoolArray, BoolArray]:
    """Return which places of the first coverage were seen, and which can be, in either placement."""
    there, here = second.scanned.coverage, first.scanned.coverage
    places = Places(there.points @ T_12[:3, :3].T + T_12[:3, 3], there.normals @ T_12[:3, :3].T)
    seen, visible = (
        at_nearest(flags, places, Places.of(here)) for flags in (there.codes == Sight.SEEN, second.visible)
    )
    seen |= here.codes == Sight.SEEN
    return seen, first.visible | visible | seen


def _write(file: Path, name: str, *clouds: tuple[FloatArray, FloatArray]) -> None:
    """Write clouds into one file; the profile's number is the number of the placement."""
    with PlyWriter(file, f"seventh-axis scan {name}, two placements joined; profile: the placement") as ply:
        for number, (points, beams) in enumerate(clouds):
            ply.write(points, beams, np.full(len(points), number))
