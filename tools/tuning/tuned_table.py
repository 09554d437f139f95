"""The whole tuning: design, judgement of the present gains for comparison, Monte Carlo, checks on the emulator."""

from collections.abc import Callable
from math import ceil, log2
from typing import NamedTuple

import control
import numpy as np

from emulator.config.constants import fixed_gains
from emulator.config.table_config import GainSetsConfig, TableConfig
from emulator.firmware.pid import Gains
from tools.bounds import Limits, TuningError
from tools.emulated import with_gains
from tools.tuning.check import Check
from tools.tuning.checks import Difference, all_checks, differences
from tools.tuning.gain_design import Design, Scan, scan
from tools.tuning.gain_files import gains_config
from tools.tuning.linear_model import Teeth
from tools.tuning.loop import closed_loop, is_stable, registers
from tools.tuning.loop_figures import LoopFigures, Loops, loop_figures, settling_ticks
from tools.tuning.monte_carlo import Outcome, monte_carlo, spread_tables
from tools.tuning.trade_off import Trade, textbook_designs, trade_off
from tools.tuning.way_out import SetDesigns, both_designs, changes, eased_limits, proved

_LEAST_ANSWER_S = 0.5


class TunedSet(NamedTuple):
    """One gain set, before and after the tuning."""

    title: str
    before: Gains
    before_figures: LoopFigures
    design: Design
    spread: Outcome


class Words(NamedTuple):
    """What reports call the two gain sets that they compare."""

    before: str
    after: str


TUNED, JUDGED = Words("former", "tuned"), Words("configured", "given")


class Tuning(NamedTuple):
    """The result of a search for gains, or for given gains."""

    before: TableConfig
    after: TableConfig
    sets: dict[str, TunedSet]  # "ramp" and "hold"
    checks: tuple[tuple[Check, Check], ...]  # before and after
    differences: tuple[Difference, ...]  # of the tuned table from the model
    limits: Limits
    eased: Limits | None  # if no gains satisfy the limits: the nearest limits that can be satisfied
    trades: tuple[Trade, ...]
    textbook: dict[str, Design]
    plants: int
    spread: float
    words: Words

    @property
    def feasible(self) -> bool:
        """Whether both sets satisfy all bounds."""
        return not any(tuned.design.broken for tuned in self.sets.values())


class Terms(NamedTuple):
    """What gain sets are judged by: bounds, and random tables about the configured one.

    Attributes:
        limits: the bounds.
        plants: the number of random tables.
        spread: by which share of itself each of their constants may differ.
        seed: of tables and checks.
    """

    limits: Limits
    plants: int
    spread: float
    seed: int


def tune(config: TableConfig, terms: Terms, progress: Callable[[float], None] = lambda _: None) -> Tuning:
    """Return the best gain sets within the limits, or the nearest ones, and their results.

    Raises:
        TuningError: no gains make both loops stable.
    """
    limits = terms.limits
    scanned = scan(Loops.of([config], grid_size(config, limits)))
    progress(0.1)
    designs = both_designs(scanned, limits)
    if not designs.stable:
        raise TuningError("no gains make the speed loop stable; shorten control.speed_window_ticks or the tick")
    eased = _eased(scanned, limits, designs) if designs.broken else None
    progress(0.3)
    return examined(scanned, terms, eased, (designs.ramp, designs.hold), progress, TUNED)


def examined(
    scanned: Scan,
    terms: Terms,
    eased: Limits | None,
    designs: tuple[Design, Design],
    progress: Callable[[float], None],
    words: Words,
) -> Tuning:
    """Return the results of the gain sets of two designs on a table, and those of its configuration."""
    loops, (ramp, hold) = scanned.loops, designs
    config, (limits, plants, spread, seed) = loops.config, terms
    after = with_gains(config, gains_config(config, ramp.gains), gains_config(config, hold.gains))
    # Half as fine as for the design, which is sufficient for all loops within the bounds.
    tables = spread_tables(config, plants, spread, seed)
    outcomes = monte_carlo(tables, designs, len(loops.z), lambda share: progress(0.3 + 0.2 * share))
    before = [fixed_gains(config, gains) for gains in (config.gains.ramp, config.gains.hold)]
    sets = {
        name: TunedSet(title, former, settled_figures(loops, former), designed, outcome)
        for name, title, former, designed, outcome in zip(
            ("ramp", "hold"), ("ramp set", "constant-speed set"), before, (ramp, hold), outcomes, strict=True
        )
    }
    progress(0.5)
    checks_before = all_checks(config, seed)
    progress(0.65)
    checks_after = all_checks(after, seed)
    progress(0.8)
    explained = differences(after, seed, checks_after)
    progress(0.85)
    trades, textbook = trade_off(scanned, limits, seed), textbook_designs(scanned, limits)
    progress(1.0)
    pairs = tuple(zip(checks_before, checks_after, strict=True))
    return Tuning(config, after, sets, pairs, explained, limits, eased, trades, textbook, plants, spread, words)


def judge(
    config: TableConfig, gains: GainSetsConfig, terms: Terms, progress: Callable[[float], None] = lambda _: None
) -> Tuning:
    """Return the results of given gain sets on a table, within the limits or not, and those of its configuration.

    Raises:
        ConfigError: the gains do not fit the firmware.
    """
    limits = terms.limits
    loops = Loops.of([config], grid_size(config, limits))
    scanned, designs = scan(loops), []
    for given, bounds in ((gains.ramp, limits.for_ramp()), (gains.hold, limits.for_hold())):
        held = registers(config, given)
        designs.append(Design(held, settled_figures(loops, held), bounds))
    return examined(scanned, terms, None, (designs[0], designs[1]), progress, JUDGED)


def settled_figures(loops: Loops, gains: Gains) -> LoopFigures:
    """Return the figures of any one gain set, however slow or unstable, for the one table of the loops.

    `loop_figures` computes the responses over time from the grid of frequencies, which contains no response longer than
    the grid.
    """
    figures = loop_figures(loops, np.array([gains]))
    states = {teeth: closed_loop(loops.config, teeth, gains) for teeth in Teeth}
    if not all(map(is_stable, states.values())):
        return figures._replace(stable=np.array([False]))
    ticks = np.arange(2 * len(loops.z)) / loops.config.control.tick_hz
    speed, lost = (
        control.step_response(states[Teeth.DRIVING]["speed_deg_s", source], ticks).outputs
        for source in ("reference_deg_s", "load_Nm")
    )
    peak = max(-float(lost.min()), 0.0)
    settling = float(max(settling_ticks(speed - 1.0, 1.0), settling_ticks(lost, peak)))
    if settling == len(ticks) - 1:
        settling = np.inf  # still outside at the end
    return figures._replace(
        stable=np.array([True]),
        overshoot=np.array([max(float(speed.max()) - 1.0, 0.0)]),
        settling_s=np.array([settling / loops.config.control.tick_hz]),
        load_peak_deg_s_Nm=np.array([peak]),
    )


def grid_size(config: TableConfig, limits: Limits) -> int:
    """Return the ticks, a power of two, in which the slowest loop within the limits has responded to a step."""
    answer_s = max(_LEAST_ANSWER_S, 5.0 / limits.bandwidth_hz, 5.0 * limits.settling_s)
    return 1 << ceil(log2(answer_s * config.control.tick_hz))


def _eased(scanned: Scan, limits: Limits, refused: SetDesigns) -> Limits | None:
    """Return limits that can be satisfied, proved on the grid of a tuning with these limits."""
    eased, config = eased_limits(scanned, limits, refused), scanned.loops.config
    if eased is None or grid_size(config, eased) == grid_size(config, limits):
        return eased
    finer = scan(Loops.of([config], grid_size(config, eased)))
    return proved(finer, limits, eased, {after.figure for _, after in changes(limits, eased)})
