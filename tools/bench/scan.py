"""The computing time of laser profiles, compared with trimesh's ray casting.

Also the time and the memory of a whole scan.
"""

import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any, TextIO

import numpy as np
import trimesh
from trimesh.ray.ray_pyembree import RayMeshIntersector

import emulator  # noqa: F401 - teaches pyserial the port emulator://
from planner.arrays import FloatArray
from planner.cell.scan import load_scan
from planner.cell.scan_path import looking_at
from planner.geometry.ray_casting import RayCaster
from planner.scanning.latched_run import TriggerConditions
from planner.scanning.probe import LaserProbe, measure
from planner.scanning.scan_run import ScanOptions, scan_workpiece
from tools.bench.timing import median_s, print_table

_LINES = 256
_BLOCK = 64
# A part of 100 mm; the second rate gives some 2000 profiles.
_PART = """
[cell]
workpiece_on_table = [0, 0, 80, 0, 0, 0]
[workpiece]
class = "cylinder"
diameter_mm = 100
height_mm = 100
[path]
pattern = "rings"
bottom_margin_mm = 20
scan_speed_mm_s = 10
time_step_s = 0.5
"""
_RATES_HZ = (10.0, 35.0)


def bench(stream: TextIO) -> None:
    """Print all measurements of profiles and scans."""
    _bench_profiles(stream)
    _bench_whole_scans(stream)


def _bench_profiles(stream: TextIO) -> None:
    mesh = trimesh.creation.icosphere(subdivisions=5, radius=50.0)
    probe, caster = LaserProbe(), RayCaster(mesh)
    peer: Any = RayMeshIntersector(mesh)
    T_WS = _poses_round(50.0)
    blocks = [T_WS[first : first + _BLOCK] for first in range(0, _LINES, _BLOCK)]
    ours_s = median_s(lambda: [measure(caster, probe, block) for block in blocks])
    peer_s = median_s(lambda: [_by_trimesh(mesh, peer, probe, block) for block in blocks])
    rows = [
        ("ours, with noise, double precision", f"{_LINES / ours_s:,.0f}", f"{peer_s / ours_s:.2f}"),
        ("trimesh + embreex", f"{_LINES / peer_s:,.0f}", "1"),
    ]
    title = f"Laser profiles, {probe.points_per_line} points, two cameras, {len(mesh.faces):,} triangles"
    print_table(stream, title, ("", "lines/s", "ratio"), rows)


def _poses_round(radius_mm: float) -> FloatArray:
    rng = np.random.default_rng(0)
    normals = rng.normal(size=(_LINES, 3))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    return looking_at(radius_mm * normals, normals, rng.normal(size=(_LINES, 3)), 150.0)


def _by_trimesh(mesh: trimesh.Trimesh, caster: Any, probe: LaserProbe, T_WS: FloatArray) -> int:  # noqa: ANN401 - no types
    """Return the number of points that are measured, found with trimesh alone."""
    rays = probe.rays()
    directions = (rays @ np.swapaxes(T_WS[:, :3, :3], 1, 2)).reshape(-1, 3)
    origins = np.repeat(T_WS[:, :3, 3], len(rays), axis=0)
    points, struck, triangles = caster.intersects_location(origins, directions, multiple_hits=False)
    normals = np.asarray(mesh.face_normals)[triangles]
    seen = np.zeros(len(points), dtype=np.bool_)
    for camera in probe.cameras_mm:
        eyes = (T_WS[:, :3, :3] @ np.array(camera) + T_WS[:, :3, 3])[struck // len(rays)]
        seen |= ~caster.intersects_any(points + 0.01 * normals, eyes - points)
    ways = origins[struck] - points
    cosines = np.sum(ways * normals, axis=1) / np.linalg.norm(ways, axis=1)
    return int((seen & (cosines >= np.cos(np.radians(probe.incidence_limit_deg)))).sum())


def _bench_whole_scans(stream: TextIO) -> None:
    rows = []
    for rate_hz in _RATES_HZ:
        program = f"from tools.bench.scan import scan_once; scan_once({rate_hz})"
        subprocess.run([sys.executable, "-c", program], check=True, capture_output=True)  # warms numba's cache
        told = subprocess.run([sys.executable, "-c", program], check=True, capture_output=True, text=True).stdout
        profiles, points, seconds, before_mb, after_mb = told.split()
        rows.append((f"{rate_hz:g}/s", profiles, points, seconds, before_mb, after_mb))
    title = "A whole scan of a part of 100 mm: plan, motion, profiles, error budget"
    print_table(stream, title, ("rate", "profiles", "points", "s", "MB imported", "MB at most"), rows)


def scan_once(rate_hz: float) -> None:
    """Scan once, and print profiles, points, seconds, and peak memory before and after (MB)."""
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "part.toml"
        file.write_text(_PART, encoding="utf-8")
        options = ScanOptions(configuration="LEFTY-ABOVE-NOFLIP", triggers=TriggerConditions(rate_hz=rate_hz))
        before_mb, begin_s = _peak_mb(), time.perf_counter()
        scanned = scan_workpiece(load_scan(file), options, Path(folder), lambda _: None)
        seconds = time.perf_counter() - begin_s
    print(len(scanned.run.numbers), scanned.points, f"{seconds:.1f}", f"{before_mb:.0f}", f"{_peak_mb():.0f}")


def _peak_mb() -> float:
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0
