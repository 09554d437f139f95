from collections.abc import Callable

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from planner.arrays import FloatArray
from planner.cell.cell import Cell, placement
from planner.geometry.transforms import rigid_inverse, rotations_z
from planner.scanning.alignment import Calibration
from planner.scanning.calibration import CalibrationError, calibrate_table_axis, sphere_centre
from planner.scanning.probe import LaserProbe
from planner.scanning.probe_calibration import calibrate_probe, cube_turns
from planner.scanning.reference_sphere import calibrate_cell, profile_of_sphere, views_of

TRUE = Calibration.of(Cell())
CENTRE = np.array([450.0, 120.0, 260.0])
RADIUS_MM = 15.0


def off(T: FloatArray, other: FloatArray) -> tuple[float, float]:
    """Return how far two poses are apart, in mm and deg."""
    difference = rigid_inverse(T) @ other
    return float(np.linalg.norm(difference[:3, 3])), float(
        np.degrees(Rotation.from_matrix(difference[:3, :3]).magnitude())
    )


def nominal_of(true: Calibration, rng: np.random.Generator) -> Calibration:
    """Return placements as a drawing would give them: some mm and some degrees off."""
    probe = placement(*rng.normal(0.0, 3.0, 3), 0.0, 0.0, 0.0) @ placement(0.0, 0.0, 0.0, 40.0, rng.normal(0, 4), -40.0)
    table = placement(*rng.normal(0.0, 3.0, 2), 0.0, 0.0, 0.0, 0.0) @ placement(0.0, 0.0, 0.0, 70.0, 1.0, -70.0)
    return Calibration(true.T_FS @ probe, true.T_BT @ table, true.T_TW)


@pytest.mark.parametrize("seed", range(6))
def test_both_calibrations_find_the_cell_within_what_they_promise(seed: int) -> None:
    rng = np.random.default_rng(seed)
    true = Calibration(
        TRUE.T_FS @ placement(*rng.uniform(-20, 20, 3), *rng.uniform(-20, 20, 3)),
        TRUE.T_BT @ placement(*rng.uniform(-20, 20, 2), 0.0, 30.0, rng.uniform(0.0, 3.0), -30.0),
        TRUE.T_TW,
    )
    found = calibrate_cell(true, nominal_of(true, rng), LaserProbe(), seed)
    distance_mm, angle_deg = off(found.calibration.T_FS, true.T_FS)
    # Three coordinates, of which none is worse than the figure given, at 4 sigma.
    assert distance_mm < 4.0 * np.sqrt(3.0) * found.probe.uncertainty_mm < 0.05
    assert angle_deg < 4.0 * np.sqrt(3.0) * found.probe.uncertainty_deg < 0.05
    assert found.probe.rms_mm < 0.025  # noise along the ray is less across the surface
    tilt = np.cross(found.calibration.T_BT[:3, 2], true.T_BT[:3, 2])
    assert np.degrees(np.linalg.norm(tilt)) < 0.002
    # The axis passes the true one at the height of the table's top.
    assert np.hypot(*(rigid_inverse(true.T_BT) @ found.calibration.T_BT)[:2, 3]) < 0.003
    assert found.axis.rms_mm < 0.003


def seen_from(T_FS: FloatArray, views: FloatArray, noise_mm: float = 0.025) -> tuple[FloatArray, list[FloatArray]]:
    rng = np.random.default_rng(1)
    probe = LaserProbe(noise_mm=noise_mm, points_per_line=160)
    return views @ rigid_inverse(T_FS), [profile_of_sphere(probe, T, CENTRE, RADIUS_MM, rng) for T in views]


def swept(views: FloatArray) -> FloatArray:
    steps = [placement(0.0, y, 0.0, 0.0, 0.0, 0.0) for y in (-8.0, -3.0, 4.0, 9.0)]
    return np.concatenate([views @ step for step in steps])


def test_a_false_minimum_is_met_and_not_taken() -> None:
    T_BF, points = seen_from(TRUE.T_FS, swept(views_of(CENTRE, 8, LaserProbe())))
    wrong_starts = 0
    for turned in list(cube_turns(TRUE.T_FS))[::5]:
        found = calibrate_probe(T_BF, points, RADIUS_MM, turned)
        wrong_starts += found.wrong_starts
        assert off(found.T_FS, TRUE.T_FS)[0] < 0.1
        assert off(found.T_FS, TRUE.T_FS)[1] < 0.1
    assert wrong_starts > 0


def test_without_noise_the_fit_is_exact() -> None:
    T_BF, points = seen_from(TRUE.T_FS, swept(views_of(CENTRE, 8, LaserProbe())), noise_mm=0.0)
    assert off(calibrate_probe(T_BF, points, RADIUS_MM, TRUE.T_FS).T_FS, TRUE.T_FS) == pytest.approx((0, 0), abs=1e-6)


def test_the_24_turns_of_a_cube_are_different_and_proper() -> None:
    turns = np.array(list(cube_turns(TRUE.T_FS)))
    assert len(np.unique(turns.round(6), axis=0)) == 24
    assert np.linalg.det(turns[:, :3, :3]) == pytest.approx(1.0)
    assert (turns[0] == TRUE.T_FS).all()


def moved_sphere() -> object:
    T_BF, points = seen_from(TRUE.T_FS, swept(views_of(CENTRE, 8, LaserProbe())))
    T_BF[10:, 0, 3] += 0.7
    return calibrate_probe(T_BF, points, RADIUS_MM, TRUE.T_FS)


def another_sphere() -> object:
    T_BF, points = seen_from(TRUE.T_FS, swept(views_of(CENTRE, 8, LaserProbe())))
    return calibrate_probe(T_BF, points, 12.7, TRUE.T_FS)


def always_in_the_middle() -> object:
    views = views_of(CENTRE, 8, LaserProbe())
    beams = views[:, :3, 2]
    views[:, :3, 3] = CENTRE - 165.0 * beams
    T_BF, points = seen_from(TRUE.T_FS, swept(views))
    return calibrate_probe(T_BF, points, RADIUS_MM, TRUE.T_FS)


def always_the_same_direction() -> object:
    one = views_of(CENTRE, 8, LaserProbe())[:1]
    T_BF, points = seen_from(TRUE.T_FS, swept(np.repeat(one, 3, axis=0)))
    return calibrate_probe(T_BF, points, RADIUS_MM, TRUE.T_FS)


def too_few_views() -> object:
    T_BF, points = seen_from(TRUE.T_FS, views_of(CENTRE, 5, LaserProbe()))
    return calibrate_probe(T_BF, points, RADIUS_MM, TRUE.T_FS)


def an_empty_view() -> object:
    T_BF, points = seen_from(TRUE.T_FS, views_of(CENTRE, 8, LaserProbe()))
    points[3] = points[3][:2]
    return calibrate_probe(T_BF, points, RADIUS_MM, TRUE.T_FS)


@pytest.mark.parametrize(
    ("views", "message"),
    [
        (moved_sphere, r"mm \(rms\) off one sphere .* did it move"),
        (another_sphere, r"mm \(rms\) off one sphere .* is this the sphere"),
        (always_in_the_middle, "fit two places of the probe equally well, 180 deg apart"),
        (always_the_same_direction, "two places|leave the probe's place open"),
        (too_few_views, "5 flange poses and 5 views .* at least 6"),
        (an_empty_view, "view 4 of the sphere has fewer than 3 points"),
    ],
)
def test_views_that_do_not_determine_the_probes_place_are_refused(views: Callable[[], object], message: str) -> None:
    with pytest.raises(CalibrationError, match=message):
        views()


ANGLES_DEG: FloatArray = np.arange(8) * np.float64(45.0)


def centres(angles_deg: FloatArray = ANGLES_DEG, radius_mm: float = 120.0) -> FloatArray:
    on_table = np.array([radius_mm, 0.0, 60.0, 1.0])
    return np.asarray((TRUE.T_BT @ rotations_z(angles_deg) @ on_table)[:, :3])


def test_an_exact_circle_gives_the_exact_axis_from_a_poor_nominal() -> None:
    nominal = TRUE.T_BT @ placement(4.0, -3.0, 0.0, 0.0, 5.0, 0.0)
    found = calibrate_table_axis(centres(), ANGLES_DEG, nominal)
    assert found.T_BT[:3, 2] == pytest.approx(TRUE.T_BT[:3, 2], abs=1e-9)
    assert np.hypot(*(rigid_inverse(TRUE.T_BT) @ found.T_BT)[:2, 3]) < 1e-6
    assert found.rms_mm < 1e-6


def test_the_residual_is_that_of_the_centres() -> None:
    noisy = centres() + np.random.default_rng(0).normal(0.0, 0.01, (8, 3))
    found = calibrate_table_axis(noisy, ANGLES_DEG, TRUE.T_BT)
    # 24 coordinates less 7 unknowns.
    assert found.rms_mm == pytest.approx(0.01 * np.sqrt(17.0 / 8.0), rel=0.5)
    assert found.residuals_mm.shape == (8,)


@pytest.mark.parametrize(
    ("centres_B", "angles_deg", "message"),
    [
        (centres()[:3], ANGLES_DEG[:3], "3 sphere centres and 3 table angles; .* at least 4"),
        (centres()[:5], ANGLES_DEG, "5 sphere centres and 8 table angles"),
        (centres(ANGLES_DEG / 8.0), ANGLES_DEG / 8.0, "span only 39 deg"),
        (centres(radius_mm=5.0), ANGLES_DEG, "only 5.0 mm radius"),
        (centres(), -ANGLES_DEG, "off the nominal one"),
        (centres() * np.nan, ANGLES_DEG, "not a finite number"),
        (centres() + np.eye(8, 3) * 2.0, ANGLES_DEG, r"mm \(rms\) off a turning table's circle"),
    ],
)
def test_centres_that_do_not_determine_an_axis_are_refused(
    centres_B: FloatArray, angles_deg: FloatArray, message: str
) -> None:
    with pytest.raises(CalibrationError, match=message):
        calibrate_table_axis(centres_B, angles_deg, TRUE.T_BT)


def test_a_centre_is_found_from_a_part_of_the_sphere() -> None:
    rng = np.random.default_rng(2)
    normals = rng.normal(size=(400, 3))
    normals[:, 2] = np.abs(normals[:, 2])
    points = CENTRE + RADIUS_MM * normals / np.linalg.norm(normals, axis=1, keepdims=True)
    assert np.abs(sphere_centre(points, RADIUS_MM) - CENTRE).max() < 1e-6
