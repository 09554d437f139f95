"""The whole tuning: design, judgement of the present gains beside it, Monte Carlo, checks on the emulator."""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from emulator.config import TableConfig
from emulator.pid import Gains, fixed_gains
from tools.emulated import with_gains
from tools.tuning.bounds import Bound, Limits
from tools.tuning.checks import Check, all_checks
from tools.tuning.gain_design import LEAST_LAG, LEAST_LOAD_PEAK, Design, design
from tools.tuning.gain_files import gains_config
from tools.tuning.loop_figures import LoopFigures, Loops, loop_figures
from tools.tuning.monte_carlo import GRID_SIZE, Outcome, monte_carlo, spread_tables

_DESIGN_GRID = 512


class TuningError(ValueError):
    """The bounds cannot be kept; the message says which, and the best that can be had."""


class TunedSet(NamedTuple):
    """One gain set, as it was and as it is now."""

    title: str
    before: Gains
    before_figures: LoopFigures
    design: Design
    spread: Outcome


class Tuning(NamedTuple):
    """The outcome."""

    before: TableConfig
    after: TableConfig
    sets: dict[str, TunedSet]  # "ramp" and "hold"
    checks: tuple[tuple[Check, Check], ...]  # before and after
    plants: int
    spread: float


def tune(
    config: TableConfig,
    limits: Limits,
    plants: int,
    spread: float,
    seed: int,
    progress: Callable[[float], None] = lambda _: None,
) -> Tuning:
    """Return the gain sets that are best within the limits, and how they do.

    Raises:
        TuningError: No gain set keeps the limits.
    """
    loops = Loops.of([config], _DESIGN_GRID)
    ramp = _designed(loops, limits.for_ramp(), LEAST_LAG, "ramp")
    progress(0.1)
    hold = _designed(loops, limits.for_hold(), LEAST_LOAD_PEAK, "constant-speed")
    progress(0.2)
    after = with_gains(config, gains_config(config, ramp.gains), gains_config(config, hold.gains))
    spread_loops = Loops.of(spread_tables(config, plants, spread, seed), GRID_SIZE)
    progress(0.6)
    sets = {}
    for name, title, designed in (("ramp", "ramp set", ramp), ("hold", "constant-speed set", hold)):
        before = fixed_gains(config, getattr(config.gains, name))
        outcome = monte_carlo(spread_loops, designed.gains, designed.bounds)
        sets[name] = TunedSet(title, before, loop_figures(loops, np.array([before])), designed, outcome)
    progress(0.7)
    checks_before = all_checks(config, seed)
    progress(0.85)
    checks = tuple(zip(checks_before, all_checks(after, seed), strict=True))
    progress(1.0)
    return Tuning(config, after, sets, checks, plants, spread)


def _designed(loops: Loops, bounds: tuple[Bound, ...], objective: str, name: str) -> Design:
    found = design(loops, bounds, objective)
    if found.broken or not found.figures.stable[0]:
        best = "; ".join(
            f"{bound}, the best is {bound.shown(getattr(found.figures, bound.figure)[0])}" for bound in found.broken
        )
        raise TuningError(f"no gains of the {name} set keep all bounds; broken are: {best or 'stability'}")
    return found
