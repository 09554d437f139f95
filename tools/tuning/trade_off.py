"""The effect of the bound on the noise: both gain sets for stricter and looser bounds, and those of textbook rules."""

from typing import NamedTuple

from emulator.config.constants import fixed_gains
from emulator.config.table_config import ConfigError, GainsConfig, TableConfig
from emulator.firmware.pid import Gains
from tools.bounds import Limits
from tools.emulated import with_gains
from tools.tuning.gain_design import Design, Scan, judged
from tools.tuning.gain_files import gains_config
from tools.tuning.nonlinear_checks import creep
from tools.tuning.textbook_rules import process_of, textbook_gains
from tools.tuning.way_out import SetDesigns, both_designs

_SHARES = (0.25, 0.35, 0.5, 0.7, 1.0, 1.5, 2.0)
"""Bounds on the noise, as shares of the requested one."""


class Trade(NamedTuple):
    """The best gain sets for one bound on the noise."""

    noise_duty: float
    designs: SetDesigns
    creep_ripple_deg_s: float  # on the emulator

    @property
    def feasible(self) -> bool:
        """Whether both sets satisfy all bounds."""
        return self.designs.stable and not self.designs.broken


def trade_off(scanned: Scan, limits: Limits, seed: int) -> tuple[Trade, ...]:
    """Return the best gain sets for several bounds on the noise, with all other bounds unchanged."""
    trades = []
    for share in _SHARES:
        designs = both_designs(scanned, limits._replace(noise_duty=share * limits.noise_duty))
        config = scanned.loops.config
        after = with_gains(config, *(gains_config(config, each.gains) for each in designs))
        trades.append(Trade(share * limits.noise_duty, designs, creep(after, seed).figures[0].emulator))
    return tuple(trades)


def textbook_designs(scanned: Scan, limits: Limits) -> dict[str, Design]:
    """Return the gain sets of textbook rules, judged by the bounds of the constant-speed set."""
    config, designs = scanned.loops.config, {}
    for name, gains in textbook_gains(process_of(config)).items():
        registers = _registers(config, gains)
        if registers is not None:
            designs[name] = judged(scanned.loops, registers, limits.for_hold())
    return designs


def _registers(config: TableConfig, gains: GainsConfig) -> Gains | None:
    """Return a gain set in the firmware's formats; None if it does not fit."""
    try:
        return fixed_gains(config, gains)
    except ConfigError:
        return None
