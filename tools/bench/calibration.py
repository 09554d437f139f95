"""How often the calibrations refuse valid and faulty measurements, and whether their stated uncertainty is correct."""

from collections.abc import Callable, Sequence
from typing import NamedTuple, TextIO

import numpy as np
from scipy.spatial.transform import Rotation

from planner.arrays import FloatArray
from planner.cell.cell import Cell, placement
from planner.geometry.transforms import rigid_inverse, rotations_z
from planner.scanning.alignment import Calibration
from planner.scanning.calibration import CalibrationError, calibrate_table_axis
from planner.scanning.probe import LaserProbe
from planner.scanning.probe_calibration import calibrate_probe
from planner.scanning.reference_sphere import profile_of_sphere, views_of
from tools.bench.timing import print_table

SEEDS = 50
_TRUE = Calibration.of(Cell())
_CENTER_B = np.array([690.0, 0.0, 180.0])
_NOMINAL_OFF = placement(1.0, -1.5, 0.0, 0.0, 0.0, 0.0) @ placement(0.0, 0.0, 0.0, 30.0, 0.5, -30.0)


class Outcome(NamedTuple):
    """One trial: refused, or the errors of position and direction in units of the stated uncertainty."""

    is_refused: bool
    position: float = np.nan
    direction: float = np.nan


class ProbeTrial(NamedTuple):
    """Views of a sphere, with their faults.

    Attributes:
        radius_mm: the radius that is given to the calibration.
        true_radius_mm: the true radius of the sphere.
        noise_mm: noise of a point along its ray.
        views: number of directions of the views.
        profiles: number of profiles from each direction.
        moved_mm: displacement of the sphere, in a random direction.
        moved_after: share of the views before the displacement; None for a continuous drift.
        is_outlier: whether it moves back after one view.
    """

    radius_mm: float = 15.0
    true_radius_mm: float = 15.0
    noise_mm: float = 0.025
    views: int = 20
    profiles: int = 7
    moved_mm: float = 0.0
    moved_after: float | None = 0.5
    is_outlier: bool = False

    def run(self, seed: int) -> Outcome:
        """Return the result of the calibration."""
        rng = np.random.default_rng((seed, 14))
        probe = LaserProbe(noise_mm=self.noise_mm)
        T_FS = _TRUE.T_FS @ placement(*rng.uniform(-20.0, 20.0, 6))
        sweep_mm = np.linspace(-0.6, 0.6, self.profiles) * self.true_radius_mm
        steps = np.stack([placement(0.0, y, 0.0, 0.0, 0.0, 0.0) for y in sweep_mm])
        poses = (views_of(_CENTER_B, self.views, probe)[:, np.newaxis] @ steps).reshape(-1, 4, 4)
        centers = _CENTER_B + self._shares(len(poses))[:, np.newaxis] * self.moved_mm * _direction(rng)
        points = [
            profile_of_sphere(probe, T, center, self.true_radius_mm, rng)
            for T, center in zip(poses, centers, strict=True)
        ]
        try:
            found = calibrate_probe(
                poses @ rigid_inverse(T_FS), points, self.radius_mm, T_FS @ _NOMINAL_OFF, self.noise_mm
            )
        except CalibrationError:
            return Outcome(True)
        off = rigid_inverse(T_FS) @ found.T_FS
        angle_deg = np.degrees(Rotation.from_matrix(off[:3, :3]).magnitude())
        return Outcome(
            False,
            float(np.linalg.norm(off[:3, 3]) / found.uncertainty_mm),
            float(angle_deg / found.uncertainty_deg),
        )

    def _shares(self, count: int) -> FloatArray:
        """Return the share of its displacement by which the sphere has moved in each view."""
        if self.moved_after is None:
            return np.linspace(0.0, 1.0, count)
        first = int(self.moved_after * count)
        shares = (np.arange(count) >= first).astype(np.float64)
        if self.is_outlier:
            shares[first + 1 :] = 0.0
        return shares


class AxisTrial(NamedTuple):
    """Centers of a sphere that turns with the table.

    Attributes:
        angles_deg: table angles.
        noise_mm: noise of each coordinate of a center.
        moved_mm: displacement of the sphere on the table halfway, in a random direction.
    """

    angles_deg: tuple[float, ...]
    noise_mm: float = 0.01
    moved_mm: float = 0.0

    def run(self, seed: int) -> Outcome:
        """Return the result of the calibration."""
        rng = np.random.default_rng((seed, 15))
        angles = np.array(self.angles_deg)
        T_BT = _TRUE.T_BT @ placement(*rng.uniform(-20.0, 20.0, 2), 0.0, 30.0, rng.uniform(0.0, 3.0), -30.0)
        seats = np.tile((120.0, 0.0, 60.0, 1.0), (len(angles), 1))
        seats[len(angles) // 2 :, :3] += self.moved_mm * _direction(rng)
        centers = np.einsum("nij,nj->ni", T_BT @ rotations_z(angles), seats)[:, :3]
        centers += rng.normal(0.0, self.noise_mm, centers.shape)
        try:
            found = calibrate_table_axis(centers, angles, _TRUE.T_BT)
        except CalibrationError:
            return Outcome(True)
        off = rigid_inverse(T_BT) @ found.T_BT
        tilt_deg = np.degrees(np.arcsin(np.hypot(off[0, 2], off[1, 2])))
        return Outcome(
            False, float(np.hypot(off[0, 3], off[1, 3]) / found.uncertainty_mm), float(tilt_deg / found.uncertainty_deg)
        )


def _direction(rng: np.random.Generator) -> FloatArray:
    direction = rng.normal(size=3)
    return np.asarray(direction / np.linalg.norm(direction))


_AROUND = tuple(float(angle) for angle in range(0, 360, 30))
AXIS_TRIALS = {
    "clean: 12 angles": AxisTrial(_AROUND),
    "clean: 4 angles": AxisTrial((0.0, 90.0, 180.0, 270.0)),
    "clean: 12 angles, noise 0.03 mm": AxisTrial(_AROUND, noise_mm=0.03),
    "bad: 0, 0.5, 120, 120.5 deg": AxisTrial((0.0, 0.5, 120.0, 120.5)),
    "bad: the same, noise 0.05 mm": AxisTrial((0.0, 0.5, 120.0, 120.5), noise_mm=0.05),
    "bad: sphere moved 0.3 mm half-way": AxisTrial(_AROUND, moved_mm=0.3),
}
PROBE_TRIALS = {
    "clean: 20 x 7 profiles": ProbeTrial(),
    "clean: 10 x 4 profiles": ProbeTrial(views=10, profiles=4),
    "clean: noise 0.1 mm": ProbeTrial(noise_mm=0.1),
    "clean: radius 6 mm": ProbeTrial(radius_mm=6.0, true_radius_mm=6.0),
    "bad: radius 15.4 mm for 15": ProbeTrial(true_radius_mm=15.4),
    "bad: radius 15.06 mm for 15": ProbeTrial(true_radius_mm=15.06),
    "bad: moved 0.3 mm half-way": ProbeTrial(moved_mm=0.3),
    "bad: moved 0.05 mm after a fifth": ProbeTrial(moved_mm=0.05, moved_after=0.2),
    "bad: drifts by 0.1 mm": ProbeTrial(moved_mm=0.1, moved_after=None),
    "bad: one view 0.3 mm off": ProbeTrial(moved_mm=0.3, is_outlier=True),
    "bad: moved, 10 x 4, noise 0.1 mm": ProbeTrial(noise_mm=0.1, views=10, profiles=4, moved_mm=0.3),
}


def bench(stream: TextIO) -> None:
    """Print how often each kind of measurement is refused, and how large the errors of the accepted ones are."""
    for title, trials in (("table axis", AXIS_TRIALS), ("probe on the flange", PROBE_TRIALS)):
        rows = [_row(name, trial.run) for name, trial in trials.items()]
        print_table(
            stream,
            f"Calibration of the {title}, {SEEDS} seeds; errors (rms) in units of the stated 1 sigma",
            ("", "refused", "position", "direction"),
            rows,
        )


def _row(name: str, run: Callable[[int], Outcome]) -> Sequence[str]:
    outcomes = [run(seed) for seed in range(SEEDS)]
    accepted = [each for each in outcomes if not each.is_refused]
    refused = f"{1.0 - len(accepted) / SEEDS:.0%}"
    if not accepted:
        return name, refused, "", ""
    position, direction = (
        np.sqrt(np.mean(np.square(column)))
        for column in ([each.position for each in accepted], [each.direction for each in accepted])
    )
    return name, refused, f"{position:.2f}", f"{direction:.2f}"
