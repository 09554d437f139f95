from dataclasses import replace

import numpy as np
import pytest

from emulator.config.table_config import load_config
from tools.bounds import Bound, Limits, violation
from tools.tuning.gain_design import LEAST_LAG, LEAST_LOAD_PEAK, Objective, design, scan
from tools.tuning.loop_figures import Loops, loop_figures
from tools.tuning.monte_carlo import monte_carlo, spread_tables
from tools.tuning.tuned_table import grid_size
from tools.tuning.way_out import both_designs, changes, eased_limits

CONFIG = load_config()
LOOPS = Loops.of([CONFIG], 512)
SCAN = scan(LOOPS)


@pytest.mark.parametrize(
    ("bounds", "objective"), [(Limits().for_ramp(), LEAST_LAG), (Limits().for_hold(), LEAST_LOAD_PEAK)]
)
def test_no_other_gains_within_the_bounds_are_clearly_better(bounds: tuple[Bound, ...], objective: Objective) -> None:
    found = design(SCAN, bounds, objective)
    factors = np.random.default_rng(1).uniform(0.6, 1.5, (4000, 3))

    others = loop_figures(LOOPS, np.round(factors * np.array(found.gains)))

    best = objective(others)[violation(bounds, others) == 0.0].min()
    assert found.broken == ()
    assert found.binding
    assert objective(found.figures)[0] <= 1.005 * best


@pytest.mark.parametrize(
    "limits",
    [Limits(bandwidth_hz=60.0), Limits(noise_duty=0.0003)],
)
def test_the_way_out_lets_both_sets_exist_and_makes_nothing_stricter(limits: Limits) -> None:
    refused = both_designs(SCAN, limits)

    eased = eased_limits(SCAN, limits, refused)

    assert refused.broken
    assert eased is not None
    assert both_designs(SCAN, eased).broken == ()
    for before, after in changes(limits, eased):
        assert after.limit > before.limit if before.at_most else after.limit < before.limit
    assert changes(limits, eased)


def test_what_no_bound_of_either_set_breaks_is_left_alone() -> None:
    """The constant-speed set alone cannot settle in 20 ms: bounds that only the ramp set has to do with stay."""
    eased = eased_limits(SCAN, Limits(settling_s=0.02), both_designs(SCAN, Limits(settling_s=0.02)))

    assert eased is not None
    assert [before.flag for before, _ in changes(Limits(settling_s=0.02), eased)] == ["--settling"]


@pytest.mark.parametrize("inertia_kg_m2", [0.003, 1.0])
def test_a_slow_or_a_quick_motor_is_kept_from_better_gains_by_a_bound_alone(inertia_kg_m2: float) -> None:
    weak = replace(CONFIG.motor, resistance_ohm=20.0, torque_constant_Nm_A=0.008)
    for motor in (CONFIG.motor, weak):
        config = replace(CONFIG, motor=motor, table=replace(CONFIG.table, inertia_kg_m2=inertia_kg_m2))
        found = design(scan(Loops.of([config], 1024)), Limits(noise_duty=0.5, bandwidth_hz=2.0).for_ramp(), LEAST_LAG)
        assert found.broken == ()
        assert found.binding


def test_a_table_with_a_fast_clock_gets_answers_in_time_as_one_with_a_slow_clock() -> None:
    """The speed is the mean over the same 8 ms, so what can be reached is nearly the same."""
    fast = replace(CONFIG, control=replace(CONFIG.control, tick_hz=2000, speed_window_ticks=16))
    bounds = Limits().for_hold()
    slow, quick = (
        design(scan(Loops.of([config], grid_size(config, Limits()))), bounds, LEAST_LOAD_PEAK).figures
        for config in (CONFIG, fast)
    )
    assert quick.load_peak_deg_s_Nm[0] == pytest.approx(slow.load_peak_deg_s_Nm[0], rel=0.2)
    assert quick.settling_s[0] == pytest.approx(slow.settling_s[0], rel=0.3)


def test_monte_carlo_without_spread_is_the_nominal_plant_and_with_it_repeats_from_its_seed() -> None:
    designed = design(SCAN, Limits().for_ramp(), LEAST_LAG)

    (same,) = monte_carlo(spread_tables(CONFIG, 3, 0.0, 1), [designed], 512)
    spread = [monte_carlo(spread_tables(CONFIG, 40, 0.2, seed), [designed], 512)[0] for seed in (7, 7, 8)]

    assert np.allclose(same.figures.sensitivity_peak, designed.figures.sensitivity_peak)
    assert same.all_share == 1.0
    peaks = [outcome.figures.sensitivity_peak.tolist() for outcome in spread]
    assert peaks[0] == peaks[1] != peaks[2]
    assert 0.0 < spread[0].all_share < 1.0


def test_monte_carlo_judges_many_tables_as_it_judges_few() -> None:
    designed = design(SCAN, Limits().for_hold(), LEAST_LOAD_PEAK)
    tables = spread_tables(CONFIG, 9, 0.2, 3)

    (few,) = monte_carlo(tables, [designed], 512)
    (many,) = monte_carlo(tables * 130, [designed], 512)  # in batches

    assert many.figures.load_peak_deg_s_Nm == pytest.approx(np.tile(few.figures.load_peak_deg_s_Nm, 130))
