from collections.abc import Callable

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from planner.arrays import FloatArray
from planner.cell.cell import Cell, placement
from planner.geometry.transforms import rigid_inverse, rotations_z
from planner.scanning.alignment import Calibration
from planner.scanning.calibration import (
    CalibrationError,
    PartSize,
    calibrate_table_axis,
)
from planner.scanning.probe import LaserProbe
from planner.scanning.probe_calibration import calibrate_probe, cube_turns
from planner.scanning.reference_sphere import calibrate_cell, profile_of_sphere, views_of
from planner.scanning.sphere_fit import fit_sphere
from tools.bench.calibration import AXIS_TRIALS, PROBE_TRIALS

TRUE = Calibration.of(Cell())
CENTER = np.array([450.0, 120.0, 260.0])
RADIUS_MM = 15.0


def off(T: FloatArray, other: FloatArray) -> tuple[float, float]:
    """Return the distance of two poses, in mm and deg."""
    difference = rigid_inverse(T) @ other
    return float(np.linalg.norm(difference[:3, 3])), float(
        np.degrees(Rotation.from_matrix(difference[:3, :3]).magnitude())
    )


def nominal_of(true: Calibration, rng: np.random.Generator) -> Calibration:
    """Return placements as from a drawing, with errors of some mm and some degrees."""
    probe = placement(*rng.normal(0.0, 3.0, 3), 0.0, 0.0, 0.0) @ placement(0.0, 0.0, 0.0, 40.0, rng.normal(0, 4), -40.0)
    table = placement(*rng.normal(0.0, 3.0, 2), 0.0, 0.0, 0.0, 0.0) @ placement(0.0, 0.0, 0.0, 70.0, 1.0, -70.0)
    return Calibration(true.T_FS @ probe, true.T_BT @ table, true.T_TW)


@pytest.mark.parametrize("seed", range(3))
def test_both_calibrations_find_the_cell_within_what_they_promise(seed: int) -> None:
    rng = np.random.default_rng(seed)
    true = Calibration(
        TRUE.T_FS @ placement(*rng.uniform(-20, 20, 3), *rng.uniform(-20, 20, 3)),
        TRUE.T_BT @ placement(*rng.uniform(-20, 20, 2), 0.0, 30.0, rng.uniform(0.0, 3.0), -30.0),
        TRUE.T_TW,
    )
    found = calibrate_cell(true, nominal_of(true, rng), LaserProbe(), seed)
    distance_mm, angle_deg = off(found.calibration.T_FS, true.T_FS)
    # Three coordinates, none of them worse than the given figure, at 4 sigma.
    assert distance_mm < 4.0 * np.sqrt(3.0) * found.probe.uncertainty_mm < 0.05
    assert angle_deg < 4.0 * np.sqrt(3.0) * found.probe.uncertainty_deg < 0.05
    assert found.probe.rms_mm < 0.025  # noise along the ray is smaller perpendicular to the surface
    tilt = np.cross(found.calibration.T_BT[:3, 2], true.T_BT[:3, 2])
    assert np.degrees(np.linalg.norm(tilt)) < 0.002
    # The axis passes the true one at the height of the table's top.
    assert np.hypot(*(rigid_inverse(true.T_BT) @ found.calibration.T_BT)[:2, 3]) < 0.003
    assert found.axis.rms_mm < 0.003


def seen_from(T_FS: FloatArray, views: FloatArray, noise_mm: float = 0.025) -> tuple[FloatArray, list[FloatArray]]:
    rng = np.random.default_rng(1)
    probe = LaserProbe(noise_mm=noise_mm, points_per_line=160)
    return views @ rigid_inverse(T_FS), [profile_of_sphere(probe, T, CENTER, RADIUS_MM, rng) for T in views]


def swept(views: FloatArray) -> FloatArray:
    steps = [placement(0.0, y, 0.0, 0.0, 0.0, 0.0) for y in (-8.0, -3.0, 4.0, 9.0)]
    return np.concatenate([views @ step for step in steps])


def test_a_false_minimum_is_met_and_not_taken() -> None:
    T_BF, points = seen_from(TRUE.T_FS, swept(views_of(CENTER, 8, LaserProbe())))
    wrong_starts = 0
    for turned in list(cube_turns(TRUE.T_FS))[::5]:
        found = calibrate_probe(T_BF, points, RADIUS_MM, turned)
        wrong_starts += found.wrong_starts
        assert off(found.T_FS, TRUE.T_FS)[0] < 0.1
        assert off(found.T_FS, TRUE.T_FS)[1] < 0.1
    assert wrong_starts > 0


def test_without_noise_the_fit_is_exact() -> None:
    T_BF, points = seen_from(TRUE.T_FS, swept(views_of(CENTER, 8, LaserProbe())), noise_mm=0.0)
    assert off(calibrate_probe(T_BF, points, RADIUS_MM, TRUE.T_FS).T_FS, TRUE.T_FS) == pytest.approx((0, 0), abs=1e-6)


def test_the_24_turns_of_a_cube_are_different_and_proper() -> None:
    turns = np.array(list(cube_turns(TRUE.T_FS)))
    assert len(np.unique(turns.round(6), axis=0)) == 24
    assert np.linalg.det(turns[:, :3, :3]) == pytest.approx(1.0)
    assert (turns[0] == TRUE.T_FS).all()


def moved_sphere() -> object:
    T_BF, points = seen_from(TRUE.T_FS, swept(views_of(CENTER, 8, LaserProbe())))
    T_BF[10:, 0, 3] += 0.7
    return calibrate_probe(T_BF, points, RADIUS_MM, TRUE.T_FS)


def another_sphere() -> object:
    T_BF, points = seen_from(TRUE.T_FS, swept(views_of(CENTER, 8, LaserProbe())))
    return calibrate_probe(T_BF, points, 12.7, TRUE.T_FS)


def always_in_the_middle() -> object:
    views = views_of(CENTER, 8, LaserProbe())
    beams = views[:, :3, 2]
    views[:, :3, 3] = CENTER - 165.0 * beams
    T_BF, points = seen_from(TRUE.T_FS, swept(views))
    return calibrate_probe(T_BF, points, RADIUS_MM, TRUE.T_FS)


def always_the_same_direction() -> object:
    one = views_of(CENTER, 8, LaserProbe())[:1]
    T_BF, points = seen_from(TRUE.T_FS, swept(np.repeat(one, 3, axis=0)))
    return calibrate_probe(T_BF, points, RADIUS_MM, TRUE.T_FS)


def always_on_the_same_side() -> object:
    beside = views_of(CENTER, 10, LaserProbe()) @ placement(0.0, -9.0, 0.0, 0.0, 0.0, 0.0)
    T_BF, points = seen_from(TRUE.T_FS, beside)
    return calibrate_probe(T_BF, points, RADIUS_MM, TRUE.T_FS)


def radius_in_meters() -> object:
    T_BF, points = seen_from(TRUE.T_FS, swept(views_of(CENTER, 8, LaserProbe())))
    return calibrate_probe(T_BF, points, 0.001 * RADIUS_MM, TRUE.T_FS)


def points_in_meters() -> object:
    T_BF, points = seen_from(TRUE.T_FS, swept(views_of(CENTER, 8, LaserProbe())))
    return calibrate_probe(T_BF, [0.001 * view for view in points], RADIUS_MM, TRUE.T_FS)


def noise_larger_than_given() -> object:
    T_BF, points = seen_from(TRUE.T_FS, swept(views_of(CENTER, 8, LaserProbe())), noise_mm=0.03)
    return calibrate_probe(T_BF, points, RADIUS_MM, TRUE.T_FS, noise_mm=0.025)


def a_pose_that_is_nan() -> object:
    T_BF, points = seen_from(TRUE.T_FS, swept(views_of(CENTER, 8, LaserProbe())))
    T_BF[3, 0, 3] = np.nan
    return calibrate_probe(T_BF, points, RADIUS_MM, TRUE.T_FS)


def too_few_views() -> object:
    T_BF, points = seen_from(TRUE.T_FS, views_of(CENTER, 5, LaserProbe()))
    return calibrate_probe(T_BF, points, RADIUS_MM, TRUE.T_FS)


def an_empty_view() -> object:
    T_BF, points = seen_from(TRUE.T_FS, views_of(CENTER, 8, LaserProbe()))
    points[3] = points[3][:2]
    return calibrate_probe(T_BF, points, RADIUS_MM, TRUE.T_FS)


@pytest.mark.parametrize(
    ("views", "message"),
    [
        (moved_sphere, r"mm \(rms\) off one sphere .* changes at view 11; check that it did not move"),
        (another_sphere, r"mm \(rms\) off one sphere .* fit one of 15.0.. mm better; check that this is the sphere"),
        (always_on_the_same_side, r"fit two places of the probe equally well, 1[78]\.. mm apart"),
        (radius_in_meters, "must all be in mm"),
        (points_in_meters, "must all be in mm"),
        (noise_larger_than_given, "1.2. times the probe's noise"),
        (a_pose_that_is_nan, "not a finite number"),
        (always_in_the_middle, "fit two places of the probe equally well, 180 deg apart"),
        (always_the_same_direction, "two places|leave the probe's pose open"),
        (too_few_views, "5 flange poses and 5 views .* at least 6"),
        (an_empty_view, "view 4 of the sphere has fewer than 3 points"),
    ],
)
def test_views_that_do_not_determine_the_probes_place_are_refused(views: Callable[[], object], message: str) -> None:
    with pytest.raises(CalibrationError, match=message):
        views()


@pytest.mark.parametrize(("beside_mm", "count"), [(-4.0, 8), (8.0, 14)])
def test_the_place_beyond_the_lasers_plane_is_looked_at_as_well(beside_mm: float, count: int) -> None:
    """All rotations of the probe lead to the true pose here: only the fit from beyond the plane finds the other."""
    beside = views_of(CENTER, count, LaserProbe()) @ placement(0.0, beside_mm, 0.0, 0.0, 0.0, 0.0)
    T_BF, points = seen_from(TRUE.T_FS, beside)
    with pytest.raises(CalibrationError, match=r"fit two places of the probe equally well, .* mm apart"):
        calibrate_probe(T_BF, points, RADIUS_MM, TRUE.T_FS)


@pytest.mark.parametrize("name", [*PROBE_TRIALS, *AXIS_TRIALS])
def test_bad_measurements_are_refused_and_the_stated_uncertainty_is_that_of_clean_ones(name: str) -> None:
    """A few seeds of each kind; `python -m tools.bench calibration` runs 50."""
    trial, seeds = (PROBE_TRIALS[name], 1) if name in PROBE_TRIALS else (AXIS_TRIALS[name], 20)
    outcomes = [trial.run(seed) for seed in range(seeds)]
    if name.startswith("bad"):
        assert all(each.is_refused for each in outcomes)
        return
    assert not any(each.is_refused for each in outcomes)
    for errors in ([each.position for each in outcomes], [each.direction for each in outcomes]):
        if seeds > 1:
            assert 0.5 < np.sqrt(np.mean(np.square(errors))) < 2.0
        else:
            assert max(errors) < 4.0


def test_one_profile_has_two_centers_and_neither_is_taken() -> None:
    T_BS = views_of(CENTER, 8, LaserProbe())[2] @ placement(0.0, 6.0, 0.0, 0.0, 0.0, 0.0)
    profile = profile_of_sphere(LaserProbe(), T_BS, CENTER, RADIUS_MM, np.random.default_rng(0))
    points = profile @ T_BS[:3, :3].T + T_BS[:3, 3]
    with pytest.raises(CalibrationError, match=r"lie in one plane; centers at \(.*\) and \(.*\) mm fit equally well"):
        fit_sphere(points, RADIUS_MM)
    with pytest.raises(CalibrationError, match="at least 4 points"):
        fit_sphere(points[:3], RADIUS_MM)


def test_the_deviation_of_a_center_is_that_of_repeated_measurements() -> None:
    probe, rng = LaserProbe(points_per_line=160), np.random.default_rng(3)
    poses = swept(views_of(CENTER, 2, probe))
    found = []
    for _ in range(60):
        profiles = [profile_of_sphere(probe, T, CENTER, RADIUS_MM, rng) @ T[:3, :3].T + T[:3, 3] for T in poses]
        found.append(fit_sphere(np.concatenate(profiles), RADIUS_MM, probe.noise_mm))
    scatter = np.std([each.center for each in found], axis=0)
    # Noise along the ray is smaller perpendicular to the surface, so that the given deviation is never too small.
    assert (scatter < 1.2 * found[0].deviations_mm).all()
    assert (scatter > 0.5 * found[0].deviations_mm).all()


ANGLES_DEG: FloatArray = np.arange(8) * np.float64(45.0)


def centers(angles_deg: FloatArray = ANGLES_DEG, radius_mm: float = 120.0) -> FloatArray:
    on_table = np.array([radius_mm, 0.0, 60.0, 1.0])
    return np.asarray((TRUE.T_BT @ rotations_z(angles_deg) @ on_table)[:, :3])


REPEATED_DEG: FloatArray = np.array([0.0, 0.5, 120.0, 120.5, 0.2, 121.0, 0.7, 119.0])
WRAPPED_DEG: FloatArray = np.array([359.0, 1.0, 120.0, 240.0, 361.0])
CLOSE_DEG: FloatArray = np.array([0.0, 12.0, 120.0, 132.0])


def noisy(angles_deg: FloatArray, noise_mm: float, moved_mm: float = 0.0) -> FloatArray:
    found = centers(angles_deg) + np.random.default_rng(0).normal(0.0, noise_mm, (len(angles_deg), 3))
    found[len(angles_deg) // 2 :, 2] += moved_mm
    return found


def test_the_axis_error_allowed_is_that_at_the_edge_of_the_part() -> None:
    angles_deg = np.array([0.0, 40.0, 80.0, 120.0])
    at_edge = [
        calibrate_table_axis(noisy(angles_deg, 0.01), angles_deg, TRUE.T_BT, part=PartSize(*size)).point_error_mm
        for size in ((20.0, 50.0), (150.0, 50.0), (150.0, 200.0))
    ]
    assert at_edge[0] < at_edge[1] < at_edge[2]
    with pytest.raises(CalibrationError, match="240 mm radius and 900 mm height"):
        calibrate_table_axis(noisy(angles_deg, 0.01), angles_deg, TRUE.T_BT, part=PartSize(240.0, 900.0))


def test_an_exact_circle_gives_the_exact_axis_from_a_poor_nominal() -> None:
    nominal = TRUE.T_BT @ placement(4.0, -3.0, 0.0, 0.0, 5.0, 0.0)
    found = calibrate_table_axis(centers(), ANGLES_DEG, nominal)
    assert found.T_BT[:3, 2] == pytest.approx(TRUE.T_BT[:3, 2], abs=1e-9)
    assert np.hypot(*(rigid_inverse(TRUE.T_BT) @ found.T_BT)[:2, 3]) < 1e-6
    assert found.rms_mm < 1e-6


def test_the_residual_is_that_of_the_centers() -> None:
    noisy = centers() + np.random.default_rng(0).normal(0.0, 0.01, (8, 3))
    found = calibrate_table_axis(noisy, ANGLES_DEG, TRUE.T_BT)
    # 24 coordinates minus 7 unknowns.
    assert found.rms_mm == pytest.approx(0.01 * np.sqrt(17.0 / 8.0), rel=0.5)
    assert found.residuals_mm.shape == (8,)


@pytest.mark.parametrize(
    ("centers_B", "angles_deg", "message"),
    [
        (centers()[:3], ANGLES_DEG[:3], "3 sphere centers and 3 table angles; .* at least 4"),
        (centers(REPEATED_DEG), REPEATED_DEG, "the 8 table angles are only 2 distinct places; .* at least 4"),
        (centers(WRAPPED_DEG), WRAPPED_DEG, "the 5 table angles are only 3 distinct places"),
        (noisy(CLOSE_DEG, 0.05), CLOSE_DEG, r"axis open by .* mm and .* deg .* 150 mm radius .* allowed are 0.1 mm"),
        (noisy(ANGLES_DEG, 0.02, 1.0), ANGLES_DEG, "changes at center 5; check that it did not move"),
        (centers()[:5], ANGLES_DEG, "5 sphere centers and 8 table angles"),
        (centers(ANGLES_DEG / 8.0), ANGLES_DEG / 8.0, "span only 39 deg"),
        (centers(radius_mm=5.0), ANGLES_DEG, "only 5.0 mm radius"),
        (centers(), -ANGLES_DEG, "off the nominal one"),
        (centers() * np.nan, ANGLES_DEG, "not a finite number"),
        (centers() + np.eye(8, 3) * 2.0, ANGLES_DEG, r"mm \(rms\) off a turning table's circle"),
    ],
)
def test_centers_that_do_not_determine_an_axis_are_refused(
    centers_B: FloatArray, angles_deg: FloatArray, message: str
) -> None:
    with pytest.raises(CalibrationError, match=message):
        calibrate_table_axis(centers_B, angles_deg, TRUE.T_BT)


@pytest.mark.parametrize("wrong", [0.0, -1.0, np.nan, np.inf])
def test_a_noise_or_radius_that_cannot_be_is_refused(wrong: float) -> None:
    views = seen_from(TRUE.T_FS, views_of(CENTER, 8, LaserProbe()))
    with pytest.raises(CalibrationError, match=r"noise is .* finite number above 0"):
        calibrate_table_axis(centers(), ANGLES_DEG, TRUE.T_BT, noise_mm=wrong)
    with pytest.raises(CalibrationError, match=r"noise is .* finite number above 0"):
        calibrate_probe(*views, RADIUS_MM, TRUE.T_FS, noise_mm=wrong)
    with pytest.raises(CalibrationError, match="must all be in mm"):
        calibrate_probe(*views, wrong, TRUE.T_FS)
    with pytest.raises(CalibrationError, match=r"radius is .* finite number above 0"):
        fit_sphere(centers(), wrong)


def test_a_center_is_found_from_a_part_of_the_sphere() -> None:
    rng = np.random.default_rng(2)
    normals = rng.normal(size=(400, 3))
    normals[:, 2] = np.abs(normals[:, 2])
    points = CENTER + RADIUS_MM * normals / np.linalg.norm(normals, axis=1, keepdims=True)
    assert np.abs(fit_sphere(points, RADIUS_MM).center - CENTER).max() < 1e-6
