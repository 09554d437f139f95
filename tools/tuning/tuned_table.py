"""The whole tuning: design, judgement of the present gains beside it, Monte Carlo, checks on the emulator."""

from collections.abc import Callable
from math import ceil, log2
from typing import NamedTuple

import numpy as np

from emulator.config.constants import fixed_gains
from emulator.config.table_config import TableConfig
from emulator.firmware.pid import Gains
from tools.emulated import with_gains
from tools.tuning.bounds import Bound, Limits
from tools.tuning.check import Check
from tools.tuning.checks import Difference, all_checks, differences
from tools.tuning.gain_design import LEAST_LAG, LEAST_LOAD_PEAK, Design, Objective, Relaxation, design, relaxations
from tools.tuning.gain_files import gains_config
from tools.tuning.loop_figures import LoopFigures, Loops, loop_figures
from tools.tuning.monte_carlo import Outcome, monte_carlo, spread_tables

_LEAST_ANSWER_S = 0.5


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
    differences: tuple[Difference, ...]  # of the tuned table from the model
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
    size = grid_size(config, limits)
    loops = Loops.of([config], size)
    ramp = _designed(loops, limits.for_ramp(), LEAST_LAG, "ramp")
    progress(0.15)
    hold = _designed(loops, limits.for_hold(), LEAST_LOAD_PEAK, "constant-speed")
    progress(0.3)
    after = with_gains(config, gains_config(config, ramp.gains), gains_config(config, hold.gains))
    # Half as fine as for the design: no loop within the bounds needs more.
    tables = spread_tables(config, plants, spread, seed)
    outcomes = monte_carlo(tables, (ramp, hold), size // 2, lambda share: progress(0.3 + 0.2 * share))
    before = [fixed_gains(config, gains) for gains in (config.gains.ramp, config.gains.hold)]
    sets = {
        name: TunedSet(title, former, loop_figures(loops, np.array([former])), designed, outcome)
        for name, title, former, designed, outcome in zip(
            ("ramp", "hold"), ("ramp set", "constant-speed set"), before, (ramp, hold), outcomes, strict=True
        )
    }
    progress(0.5)
    checks_before = all_checks(config, seed)
    progress(0.8)
    checks_after = all_checks(after, seed)
    progress(0.9)
    explained = differences(after, seed, checks_after)
    progress(1.0)
    pairs = tuple(zip(checks_before, checks_after, strict=True))
    return Tuning(config, after, sets, pairs, explained, plants, spread)


def grid_size(config: TableConfig, limits: Limits) -> int:
    """Return the ticks, a power of two, in which the slowest loop within the limits has answered to a step."""
    answer_s = max(_LEAST_ANSWER_S, 5.0 / limits.bandwidth_hz, 5.0 * limits.settling_s)
    return 1 << ceil(log2(answer_s * config.control.tick_hz))


def _designed(loops: Loops, bounds: tuple[Bound, ...], objective: Objective, name: str) -> Design:
    found = design(loops, bounds, objective)
    if found.broken or not found.figures.stable[0]:
        raise TuningError(f"no gains of the {name} set keep all bounds; {_way_out(loops, found)}")
    return found


def _way_out(loops: Loops, refused: Design) -> str:
    ways = relaxations(loops, refused)
    if not ways:
        nearest = [f"{bound}: {bound.shown(getattr(refused.figures, bound.figure)[0])}" for bound in refused.broken]
        return f"more than two stand in each other's way; nearest to all come gains with {', '.join(nearest)}"
    best = " or ".join(map(_relaxed, ways))
    return f"the best that can be had{' with one of them relaxed' if len(ways) > 1 else ''} is {best}"


def _relaxed(way: Relaxation) -> str:
    return " with ".join(
        f"{bound.title} {bound.shown(bound.allowing(float(getattr(way.figures, bound.figure)[0])))} "
        f"(asked is {bound.asked})"
        for bound in way.bounds
    )
