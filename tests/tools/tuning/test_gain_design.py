from dataclasses import replace

import numpy as np
import pytest

from emulator.config.table_config import load_config
from tools.tuning.bounds import Bound, Limits, violation
from tools.tuning.gain_design import LEAST_LAG, LEAST_LOAD_PEAK, Objective, design, relaxations
from tools.tuning.loop_figures import Loops, loop_figures
from tools.tuning.monte_carlo import monte_carlo, spread_tables
from tools.tuning.tuned_table import TuningError, grid_size, tune

CONFIG = load_config()
LOOPS = Loops.of([CONFIG], 512)


@pytest.mark.parametrize(
    ("bounds", "objective"), [(Limits().for_ramp(), LEAST_LAG), (Limits().for_hold(), LEAST_LOAD_PEAK)]
)
def test_no_other_gains_within_the_bounds_are_clearly_better(bounds: tuple[Bound, ...], objective: Objective) -> None:
    found = design(LOOPS, bounds, objective)
    factors = np.random.default_rng(1).uniform(0.6, 1.5, (4000, 3))

    others = loop_figures(LOOPS, np.round(factors * np.array(found.gains)))

    best = objective(others)[violation(bounds, others) == 0.0].min()
    assert found.broken == ()
    assert found.binding
    assert objective(found.figures)[0] <= 1.005 * best


def test_bounds_that_cannot_be_kept_are_named_with_the_best_that_can_be_had() -> None:
    with pytest.raises(TuningError, match=r"ramp set .* best .* bandwidth [0-9.]+ Hz \(asked is at least 70 Hz\)"):
        tune(CONFIG, Limits(bandwidth_hz=70.0), plants=1, spread=0.2, seed=0)


@pytest.mark.parametrize("limits", [Limits(bandwidth_hz=60.0), Limits(settling_s=0.02)])
def test_the_best_that_can_be_had_can_be_had(limits: Limits) -> None:
    bounds = limits.for_hold()

    ways = relaxations(LOOPS, design(LOOPS, bounds, LEAST_LOAD_PEAK))

    assert ways
    for way in ways:
        eased = {
            bound.figure: bound._replace(limit=bound.allowing(float(getattr(way.figures, bound.figure)[0])))
            for bound in way.bounds
        }
        assert not design(LOOPS, tuple(eased.get(each.figure, each) for each in bounds), LEAST_LOAD_PEAK).broken


@pytest.mark.parametrize("inertia_kg_m2", [0.003, 1.0])
def test_a_slow_or_a_quick_motor_is_kept_from_better_gains_by_a_bound_alone(inertia_kg_m2: float) -> None:
    weak = replace(CONFIG.motor, resistance_ohm=20.0, torque_constant_Nm_A=0.008)
    for motor in (CONFIG.motor, weak):
        config = replace(CONFIG, motor=motor, table=replace(CONFIG.table, inertia_kg_m2=inertia_kg_m2))
        found = design(Loops.of([config], 1024), Limits(noise_duty=0.5, bandwidth_hz=2.0).for_ramp(), LEAST_LAG)
        assert found.broken == ()
        assert found.binding


def test_a_table_with_a_fast_clock_gets_answers_in_time_as_one_with_a_slow_clock() -> None:
    """The speed is the mean over the same 8 ms, so what can be reached is nearly the same."""
    fast = replace(CONFIG, control=replace(CONFIG.control, tick_hz=2000, speed_window_ticks=16))
    bounds = Limits().for_hold()
    slow, quick = (
        design(Loops.of([config], grid_size(config, Limits())), bounds, LEAST_LOAD_PEAK).figures
        for config in (CONFIG, fast)
    )
    assert quick.load_peak_deg_s_Nm[0] == pytest.approx(slow.load_peak_deg_s_Nm[0], rel=0.2)
    assert quick.settling_s[0] == pytest.approx(slow.settling_s[0], rel=0.3)


def test_monte_carlo_without_spread_is_the_nominal_plant_and_with_it_repeats_from_its_seed() -> None:
    designed = design(LOOPS, Limits().for_ramp(), LEAST_LAG)

    (same,) = monte_carlo(spread_tables(CONFIG, 3, 0.0, 1), [designed], 512)
    spread = [monte_carlo(spread_tables(CONFIG, 40, 0.2, seed), [designed], 512)[0] for seed in (7, 7, 8)]

    assert np.allclose(same.figures.sensitivity_peak, designed.figures.sensitivity_peak)
    assert same.all_share == 1.0
    peaks = [outcome.figures.sensitivity_peak.tolist() for outcome in spread]
    assert peaks[0] == peaks[1] != peaks[2]
    assert 0.0 < spread[0].all_share < 1.0


def test_monte_carlo_judges_many_tables_as_it_judges_few() -> None:
    designed = design(LOOPS, Limits().for_hold(), LEAST_LOAD_PEAK)
    tables = spread_tables(CONFIG, 9, 0.2, 3)

    (few,) = monte_carlo(tables, [designed], 512)
    (many,) = monte_carlo(tables * 130, [designed], 512)  # in batches

    assert many.figures.load_peak_deg_s_Nm == pytest.approx(np.tile(few.figures.load_peak_deg_s_Nm, 130))
