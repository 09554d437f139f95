from dataclasses import replace

import pytest

from emulator.config.table_config import DiscConfig, GainsConfig, MotionConfig, load_config
from tools.emulated import with_gains
from tools.tuning.check import Check, Curve, Figure
from tools.tuning.checks import all_checks, differences, differs
from tools.tuning.linear_checks import load_step, load_step_Nm, ramp, step
from tools.tuning.nonlinear_checks import creep

CONFIG = load_config()
CHECKS = all_checks(CONFIG, seed=1)
FIGURES = [figure for check in CHECKS for figure in check.figures]


@pytest.mark.parametrize(
    "figure", [figure for figure in FIGURES if figure.model is not None], ids=lambda each: each.key
)
def test_the_emulator_does_what_the_linear_model_predicts(figure: Figure) -> None:
    assert figure.emulator == pytest.approx(figure.model, rel=0.2)


def test_small_moves_of_the_default_table_end_near_their_target() -> None:
    (miss,) = (figure for figure in FIGURES if figure.key == "rest_error_deg")
    assert miss.emulator < 0.05


def test_the_load_on_the_default_table_is_the_one_of_its_linear_design() -> None:
    assert load_step_Nm(CONFIG) == 0.29


@pytest.mark.parametrize("share", [0.1, 2.0])
def test_a_table_with_other_gears_is_checked_within_its_own_speeds_and_loads(share: float) -> None:
    """With another gear ratio, the same motor with the same load makes the same motion, scaled at the table."""
    ramp, hold = (
        replace(gains, proportional_duty_s_deg=gains.proportional_duty_s_deg / share)
        for gains in (CONFIG.gains.ramp, CONFIG.gains.hold)
    )
    config = replace(
        with_gains(CONFIG, ramp, hold),
        limits=MotionConfig(share * CONFIG.limits.speed_deg_s, share * CONFIG.limits.acceleration_deg_s2),
        gears=replace(CONFIG.gears, ratio=CONFIG.gears.ratio / share),
        table=DiscConfig(CONFIG.table.inertia_kg_m2 / share**2, CONFIG.table.bearing_friction_Nm / share),
    )

    for figure in (*step(config, 1).figures, *load_step(config, 1).figures):
        assert figure.emulator == pytest.approx(figure.model, rel=0.25)


def test_the_model_changes_the_gain_set_after_the_ramp_as_the_firmware_does() -> None:
    """What the encoder stays behind is made up in part by the second set, the less the longer its integral time."""
    config = replace(
        with_gains(CONFIG, GainsConfig(0.01775, 0.0181, 0.0007), GainsConfig(0.0191, 0.0445, 0.0009)),
        table=replace(CONFIG.table, inertia_kg_m2=3.0),
        gears=replace(CONFIG.gears, backlash_arcmin=0.0),
    )

    for figure in ramp(config, 0).figures:
        assert figure.emulator == pytest.approx(figure.model, rel=0.1)


@pytest.mark.parametrize("seed", range(3))
def test_the_ripple_at_creep_is_that_of_a_moving_table_however_wide_the_gap(seed: int) -> None:
    """The gap of 2 deg takes ten seconds at 0.2 deg/s."""
    wide = replace(CONFIG, gears=replace(CONFIG.gears, backlash_arcmin=120.0))

    ripple = creep(wide, seed).figures[0].emulator

    assert ripple == pytest.approx(creep(CONFIG, seed).figures[0].emulator, rel=0.3)


def test_a_difference_is_shown_without_what_the_model_lacks() -> None:
    gap = replace(CONFIG, gears=replace(CONFIG.gears, backlash_arcmin=300.0))
    checks = [run if run.key != "ramp" else _with_wrong_model(run) for run in all_checks(gap, seed=1)]

    found = differences(gap, 1, checks)

    assert {each.figure for each in found} == {figure for run in checks for figure in run.figures if differs(figure)}
    lag = next(each for each in found if each.figure.key == "ramp_lag_deg_s")
    assert set(lag.without) == {"stiction", "backlash", "both"}
    assert lag.without["stiction"] != lag.without["backlash"]


def _with_wrong_model(run: Check) -> Check:
    curve: Curve = run.curve
    figures: tuple[Figure, ...] = tuple(figure._replace(model=2.0 * figure.emulator) for figure in run.figures)
    return run._replace(curve=curve, figures=figures)
