"""Fit a sphere of known radius to points."""

from typing import NamedTuple

import numpy as np
from scipy.optimize import least_squares

from planner.arrays import FloatArray
from planner.scanning.calibration import CalibrationError

# A sphere of known radius has three unknowns. A second center with a residual up to this much larger is ambiguous.
_FEWEST_POINTS = 4
_RIVAL_RATIO = 1.5


class SphereFit(NamedTuple):
    """A sphere of known radius through points.

    Attributes:
        center: `(3,)` in mm.
        rms_mm: root mean square of the points' heights above it.
        deviations_mm: `(3,)` standard deviation of each coordinate of the center, for heights with the given noise.
    """

    center: FloatArray
    rms_mm: float
    deviations_mm: FloatArray


def fit_sphere(points: FloatArray, radius_mm: float, noise_mm: float = 0.0) -> SphereFit:
    """Return the sphere of known radius through points `(m, 3)`, with its uncertainty, by least squares.

    Points in one plane, such as those of a single profile, fit two spheres, one on each side of their plane; they are
    refused.

    Args:
        points: points in mm.
        radius_mm: radius of the sphere.
        noise_mm: standard deviation of the points' heights.

    Raises:
        CalibrationError: there are fewer than 4 points, or two centers fit equally well.
    """
    if len(points) < _FEWEST_POINTS or not np.isfinite(points).all():
        raise CalibrationError(f"a sphere's center needs at least {_FEWEST_POINTS} points, all of them finite")

    if not 0.0 < radius_mm < np.inf:
        raise CalibrationError(f"the sphere's radius is {radius_mm:g} mm; it must be a finite number above 0")

    def heights(center: FloatArray) -> FloatArray:
        return np.asarray(np.linalg.norm(points - center, axis=1) - radius_mm)

    # |p|^2 = 2 p.c + (r^2 - |c|^2) is linear and gives the start.
    middle = points.mean(axis=0)
    design = np.column_stack((2.0 * (points - middle), np.ones(len(points))))
    start = middle + np.linalg.lstsq(design, np.sum((points - middle) ** 2, axis=1), rcond=None)[0][:3]
    across = np.linalg.svd(points - middle, full_matrices=False)[2][2]
    # If the points are nearly flat, the linear fit does not determine the side: both are tried.
    offset_mm = (start - middle) @ across
    height_mm = np.sqrt(max(radius_mm**2 - np.mean(np.sum((points - middle) ** 2, axis=1)), (0.1 * radius_mm) ** 2))
    ends = [
        least_squares(heights, start + (side * height_mm - offset_mm) * across, x_scale=radius_mm)
        for side in (1.0, -1.0)
    ]
    ends.sort(key=lambda end: float(end.cost))
    one, other = (end.x for end in ends)
    if (
        ends[1].cost <= _RIVAL_RATIO**2 * ends[0].cost + 1e-12 * len(points)
        and np.linalg.norm(one - other) > 0.01 * radius_mm
    ):
        a, b = (", ".join(f"{value:.2f}" for value in center) for center in (one, other))
        raise CalibrationError(
            f"the points of the sphere lie in one plane; centers at ({a}) and ({b}) mm fit equally well;"
            " add profiles from another position"
        )
    jacobian = np.asarray(ends[0].jac)
    deviations_mm = noise_mm * np.sqrt(np.diag(np.linalg.pinv(jacobian.T @ jacobian, hermitian=True)))
    return SphereFit(one, float(np.sqrt(np.mean(ends[0].fun ** 2))), deviations_mm)
