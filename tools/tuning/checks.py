"""All checks of a table with its gain sets on the compiled emulator, and the differences from the linear model."""

from collections.abc import Callable
from dataclasses import replace
from typing import NamedTuple

from emulator.config.table_config import GainsConfig, TableConfig
from tools.emulated import with_gains
from tools.tuning.check import Check, Figure
from tools.tuning.linear_checks import load_step, ramp, step
from tools.tuning.loop import registers
from tools.tuning.noise_check import noise
from tools.tuning.nonlinear_checks import creep, reversal, small_moves

AGREES_SHARE = 0.2
"""A difference above this share of the model's prediction is explained."""

_CHECKS: tuple[Callable[[TableConfig, int], Check], ...] = (
    ramp,
    step,
    load_step,
    noise,
    small_moves,
    reversal,
    creep,
)


class EmulatorChecks(NamedTuple):
    """Runs of one table with its gain sets, and all their figures, by key."""

    runs: dict[str, Check]
    figures: dict[str, Figure]


class Difference(NamedTuple):
    """A figure in which emulator and model differ, and its value on the emulator without some of its effects."""

    figure: Figure
    without: dict[str, float]


def check_on_emulator(config: TableConfig, ramp: GainsConfig, hold: GainsConfig, seed: int = 0) -> EmulatorChecks:
    """Run all checks of a table with given gain sets; takes seconds.

    Args:
        config: the table.
        ramp: gain set for ramps, in engineering units.
        hold: gain set for a constant speed.
        seed: determines the position of the shaft between two counts, and of the teeth within the backlash.

    Raises:
        ConfigError: as `loop.registers`.
    """
    for gains in (ramp, hold):
        registers(config, gains)
    checks = all_checks(with_gains(config, ramp, hold), seed)
    return EmulatorChecks(
        {check.key: check for check in checks}, {figure.key: figure for check in checks for figure in check.figures}
    )


def all_checks(config: TableConfig, seed: int) -> list[Check]:
    """Return all checks of a table with its gain sets."""
    return [check(config, seed) for check in _CHECKS]


def differs(figure: Figure) -> bool:
    """Return whether the emulator differs from the model's prediction."""
    return figure.model is not None and abs(figure.emulator - figure.model) > AGREES_SHARE * abs(figure.model)


def differences(config: TableConfig, seed: int, checks: list[Check]) -> tuple[Difference, ...]:
    """Return the figures in which emulator and model differ, each with its values without the omitted effects."""
    found = []
    for run, check in zip(_CHECKS, checks, strict=True):
        if not any(map(differs, check.figures)):
            continue
        others = {effect: run(table, seed).figures for effect, table in _without(config).items()}
        for index, figure in enumerate(check.figures):
            if differs(figure):
                found.append(Difference(figure, {effect: each[index].emulator for effect, each in others.items()}))
    return tuple(found)


def _without(config: TableConfig) -> dict[str, TableConfig]:
    friction, gears = replace(config.friction, stiction_ratio=1.0), replace(config.gears, backlash_arcmin=0.0)
    return {
        "stiction": replace(config, friction=friction),
        "backlash": replace(config, gears=gears),
        "both": replace(config, friction=friction, gears=gears),
    }
