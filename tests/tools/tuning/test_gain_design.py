import numpy as np
import pytest

from emulator.config import load_config
from emulator.pid import fixed_gains
from tools.tuning.bounds import Limits, violation
from tools.tuning.gain_design import LEAST_LAG, LEAST_LOAD_PEAK, design
from tools.tuning.gain_files import gains_config, gains_header, gains_toml
from tools.tuning.loop_figures import Loops, loop_figures
from tools.tuning.monte_carlo import monte_carlo, spread_tables
from tools.tuning.tuned_table import TuningError, tune

CONFIG = load_config()
LOOPS = Loops.of([CONFIG], 512)


@pytest.mark.parametrize(
    ("bounds", "objective"), [(Limits().for_ramp(), LEAST_LAG), (Limits().for_hold(), LEAST_LOAD_PEAK)]
)
def test_no_other_gains_within_the_bounds_are_clearly_better(bounds: tuple, objective: str) -> None:  # type: ignore[type-arg]  # of Bound
    found = design(LOOPS, bounds, objective)
    factors = np.random.default_rng(1).uniform(0.6, 1.5, (4000, 3))

    others = loop_figures(LOOPS, np.round(factors * np.array(found.gains)))

    best = getattr(others, objective)[violation(bounds, others) == 0.0].min()
    assert found.broken == ()
    assert found.binding
    assert getattr(found.figures, objective)[0] <= 1.005 * best


def test_the_files_give_back_the_registers_that_were_judged(tmp_path_factory: pytest.TempPathFactory) -> None:
    found = design(LOOPS, Limits().for_hold(), LEAST_LOAD_PEAK)
    gains = gains_config(CONFIG, found.gains)
    path = tmp_path_factory.mktemp("gains") / "gains.toml"
    path.write_text(gains_toml({"ramp": gains, "hold": gains}), encoding="utf-8")

    read = load_config(path)

    assert fixed_gains(read, read.gains.hold) == fixed_gains(read, read.gains.ramp) == found.gains
    header = gains_header({"hold": found.gains})
    macros = dict(line.split()[1:3] for line in header.splitlines() if line.startswith("#define GAINS_"))
    assert macros == {f"GAINS_HOLD_{key.upper()}": f"{value}L" for key, value in found.gains._asdict().items()}


def test_bounds_that_cannot_be_kept_are_named_with_the_best_that_can_be_had() -> None:
    with pytest.raises(TuningError, match=r"ramp set .*phase margin at least 85 deg, the best is [0-9.]+ deg"):
        tune(CONFIG, Limits(phase_margin_deg=85.0, bandwidth_hz=40.0), plants=1, spread=0.2, seed=0)


def test_monte_carlo_without_spread_is_the_nominal_plant_and_with_it_repeats_from_its_seed() -> None:
    bounds = Limits(sensitivity_peak=1.8).for_ramp()
    gains = fixed_gains(CONFIG, CONFIG.gains.ramp)

    same = monte_carlo(Loops.of(spread_tables(CONFIG, 3, 0.0, 1), 512), gains, bounds)
    spread = [monte_carlo(Loops.of(spread_tables(CONFIG, 40, 0.2, 7), 512), gains, bounds) for _ in range(2)]

    nominal = loop_figures(LOOPS, np.array([gains]))
    assert np.allclose(same.figures.sensitivity_peak, nominal.sensitivity_peak)
    assert same.all_share == 1.0
    assert spread[0].figures.sensitivity_peak.tolist() == spread[1].figures.sensitivity_peak.tolist()
    assert 0.0 < spread[0].all_share < 1.0
