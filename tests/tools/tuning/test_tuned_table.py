from dataclasses import replace

import numpy as np
import pytest

from emulator.config.table_config import GainsConfig, load_config
from tests.tools.tuning import loop_oracle
from tools.bounds import Limits
from tools.tuning.gain_design import Design
from tools.tuning.gain_files import gains_config
from tools.tuning.linear_model import Teeth
from tools.tuning.loop import registers
from tools.tuning.loop_figures import LoopFigures, Loops, loop_figures
from tools.tuning.tuned_table import grid_size, settled_figures

CONFIG = load_config()
LIMITS = Limits()
SLOW = GainsConfig(0.004, 2.0, 0.0)
LOOPS = Loops.of([CONFIG], grid_size(CONFIG, LIMITS))


def figures_of(gains: GainsConfig) -> LoopFigures:
    return settled_figures(LOOPS, registers(CONFIG, gains))


def test_quick_gains_have_the_figures_that_the_grid_of_frequencies_gives() -> None:
    held = registers(CONFIG, CONFIG.gains.hold)

    for name, found in settled_figures(LOOPS, held)._asdict().items():
        expected = getattr(loop_figures(LOOPS, np.array([held])), name)[0]
        assert found[0] == pytest.approx(expected, rel=1e-3, abs=1e-4), name


def test_slow_gains_do_not_settle_within_the_grid() -> None:
    """From the differential equations, over a time in which this loop has settled."""
    ticks = 1 << 16
    hz = np.arange(1, ticks // 2 + 1) * (CONFIG.control.tick_hz / ticks)
    held = gains_config(CONFIG, registers(CONFIG, SLOW))
    with_few_aliases = loop_oracle.loop(CONFIG, Teeth.DRIVING, held, hz, aliases=20)
    lost = loop_oracle.step_response(with_few_aliases.speed_by_load, 0.0)

    figures = figures_of(SLOW)

    assert figures.stable[0]
    assert figures.settling_s[0] == np.inf
    assert figures.load_peak_deg_s_Nm[0] == pytest.approx(-lost[: 2 * len(LOOPS.z)].min(), rel=0.01)
    assert Design(registers(CONFIG, SLOW), figures, LIMITS.for_hold()).broken[-1].figure == "settling_s"


@pytest.mark.parametrize("factor", [0.5, 1.0, 2.0, 3.0, 4.0, 10.0])
def test_a_loop_that_is_not_stable_breaks_all_bounds(factor: float) -> None:
    """Stable by Nyquist: the free motor's loop, the quickest, has a gain margin of 8.9 dB, which is a factor of 2.8."""
    hold = CONFIG.gains.hold
    gains = replace(hold, proportional_duty_s_deg=factor * hold.proportional_duty_s_deg)

    found = Design(registers(CONFIG, gains), figures_of(gains), LIMITS.for_hold())

    assert bool(found.figures.stable[0]) == (factor < 2.8)
    assert (found.broken == found.bounds) == (factor > 2.8)
