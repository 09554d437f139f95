"""Simulated measurements of a reference sphere for the two calibrations, in closed form."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from planner.arrays import FloatArray
from planner.cell.cell import placement
from planner.cell.scan_path import looking_at
from planner.geometry.transforms import rigid_inverse, rotations_z
from planner.scanning.alignment import Calibration
from planner.scanning.calibration import AxisCalibration, PartSize, calibrate_table_axis
from planner.scanning.probe import LaserProbe
from planner.scanning.probe_calibration import ProbeCalibration, calibrate_probe
from planner.scanning.sphere_fit import fit_sphere

_RADIUS_MM = 15.0
# Position of the sphere on the table for the axis; for the probe it is on the table too, which does not turn.
_SEAT_T_MM = (120.0, 0.0, 60.0)
_TABLE_ANGLES = 12
# A sweep over the sphere, in steps of the probe perpendicular to its line.
_SWEEP_MM = np.linspace(-9.0, 9.0, 7)


@dataclass(frozen=True, eq=False)
class CellCalibration:
    """The results of both calibrations of one cell."""

    axis: AxisCalibration
    probe: ProbeCalibration
    calibration: Calibration


class Sweep(NamedTuple):
    """Profiles of a sphere: their flange poses, and the points of each, in frame S."""

    T_BF: FloatArray
    points_S: list[FloatArray]


def profile_of_sphere(
    probe: LaserProbe, T_BS: FloatArray, center_B: FloatArray, radius_mm: float, rng: np.random.Generator
) -> FloatArray:
    """Return the points `(m, 3)` in frame S that a probe at T_BS measures on a sphere.

    A camera sees everything in the laser line: there is no other object. Beyond the incidence limit nothing is
    measured.
    """
    rays = probe.rays()
    center = (center_B - T_BS[:3, 3]) @ T_BS[:3, :3]
    along = rays @ center
    inside2 = along**2 - center @ center + radius_mm**2
    with np.errstate(invalid="ignore"):
        distances = along - np.sqrt(inside2)
        cosines = np.sqrt(inside2) / radius_mm
        depths = distances * rays[:, 2]
        valid = cosines >= np.cos(np.radians(probe.incidence_limit_deg))
        valid &= (depths >= probe.nearest_mm) & (depths <= probe.farthest_mm)
    measured = distances + probe.noise_mm * rng.standard_normal(len(rays))
    return np.asarray(measured[valid, np.newaxis] * rays[valid])


def sweep(
    probe: LaserProbe, views_BS: FloatArray, T_FS: FloatArray, center_B: FloatArray, rng: np.random.Generator
) -> Sweep:
    """Return profiles of the sphere from poses `(n, 4, 4)`, moved perpendicular to the line in small steps."""
    steps = np.stack([placement(0.0, step, 0.0, 0.0, 0.0, 0.0) for step in _SWEEP_MM])
    poses = (views_BS[:, np.newaxis] @ steps).reshape(-1, 4, 4)
    points = [profile_of_sphere(probe, T, center_B, _RADIUS_MM, rng) for T in poses]
    return Sweep(poses @ rigid_inverse(T_FS), points)


def views_of(center_B: FloatArray, count: int, probe: LaserProbe) -> FloatArray:
    """Return probe poses `(count, 4, 4)` around the upper side of a sphere, also rotated around their beams.

    The sphere is off the middle of the line and at varying depth. Otherwise a probe that rotates around its beam would
    always measure the same. At constant depth, a rotation of the probe looks like a shift.
    """
    number = np.arange(count)
    azimuth, polar = np.radians(137.508 * number), np.radians(10.0 + 60.0 * (number + 0.5) / count)
    normals = np.column_stack((np.sin(polar) * np.cos(azimuth), np.sin(polar) * np.sin(azimuth), np.cos(polar)))
    roll = np.radians(77.0 * number)
    lines = np.column_stack((np.cos(roll), np.sin(roll), 0.3 * np.ones(count)))
    middle_mm, span_mm = 0.5 * (probe.nearest_mm + probe.farthest_mm), probe.farthest_mm - probe.nearest_mm
    depths_mm = middle_mm + 0.2 * span_mm * np.cos(2.0 * number)
    poses = looking_at(np.tile(center_B, (count, 1)), normals, lines, 0.0)
    poses[:, :3, 3] += (depths_mm + _RADIUS_MM)[:, np.newaxis] * normals
    poses[:, :3, 3] += 10.0 * np.where(number % 3, 1.0, -1.0)[:, np.newaxis] * poses[:, :3, 0]
    return poses


def calibrate_cell(
    true: Calibration, nominal: Calibration, probe: LaserProbe, seed: int, part: PartSize | None = None
) -> CellCalibration:
    """Return the results of the two calibrations of a cell, from simulated measurements with the probe's noise.

    Args:
        true: placements of the measurements.
        nominal: placements known in advance.
        probe: the probe.
        seed: random seed of its noise.
        part: the part of the scan.
    """
    rng = np.random.default_rng((seed, 8))
    noise_mm = max(probe.noise_mm, 1e-3)
    center = (true.T_BT @ np.array((*_SEAT_T_MM, 1.0)))[:3]
    seen = sweep(probe, views_of(center, 20, probe), true.T_FS, center, rng)
    on_flange = calibrate_probe(seen.T_BF, seen.points_S, _RADIUS_MM, nominal.T_FS, noise_mm)

    angles_deg = np.arange(_TABLE_ANGLES) * 360.0 / _TABLE_ANGLES
    centers = []
    for T_turn in rotations_z(angles_deg):
        turned = (true.T_BT @ T_turn @ np.array((*_SEAT_T_MM, 1.0)))[:3]
        views = sweep(probe, views_of(turned, 3, probe), true.T_FS, turned, rng)
        T_BS = views.T_BF @ on_flange.T_FS
        in_base = [points @ T[:3, :3].T + T[:3, 3] for T, points in zip(T_BS, views.points_S, strict=True)]
        centers.append(fit_sphere(np.concatenate(in_base), _RADIUS_MM, noise_mm))
    center_noise_mm = float(np.sqrt(np.mean([center.deviations_mm**2 for center in centers])))
    axis = calibrate_table_axis(
        np.array([each.center for each in centers]), angles_deg, nominal.T_BT, noise_mm=center_noise_mm, part=part
    )
    return CellCalibration(axis, on_flange, Calibration(on_flange.T_FS, axis.T_BT, nominal.T_TW))
