"""Monte Carlo over the spread of the plant: the share of the possible tables that meet the bounds."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from emulator.config.table_config import TableConfig
from tools.bounds import Bound
from tools.tuning.frequency_response import Array
from tools.tuning.gain_design import Design
from tools.tuning.loop_figures import LoopFigures, Loops, joined, loop_figures

_BATCH = 1 << 17
"""Maximum number of plants times frequencies that are judged at once, because of the memory."""

SPREAD_KEYS = (
    ("motor", "resistance_ohm"),
    ("motor", "inductance_H"),
    ("motor", "torque_constant_Nm_A"),
    ("motor", "rotor_inertia_kg_m2"),
    ("gears", "inertia_kg_m2"),
    ("gears", "efficiency"),
    ("table", "inertia_kg_m2"),
    ("friction", "viscous_Nm_s"),
)


class Outcome(NamedTuple):
    """The plants' figures with one gain set, and the shares of plants that meet each bound and all bounds."""

    figures: LoopFigures
    shares: tuple[tuple[Bound, float], ...]
    all_share: float
    stable_share: float


def spread_tables(config: TableConfig, count: int, spread: float, seed: int) -> list[TableConfig]:
    """Return tables with constants uniformly distributed within 1 - spread to 1 + spread of the configured value."""
    factors = np.random.default_rng(seed).uniform(1.0 - spread, 1.0 + spread, (count, len(SPREAD_KEYS)))
    return [_scaled(config, row) for row in factors]


def monte_carlo(
    tables: list[TableConfig],
    designs: Sequence[Design],
    grid_size: int,
    progress: Callable[[float], None] = lambda _: None,
) -> list[Outcome]:
    """Return the results of the tables with each of the gain sets, on a common grid of frequencies."""
    parts: list[list[LoopFigures]] = [[] for _ in designs]
    count = max(1, 2 * _BATCH // grid_size)
    for start in range(0, len(tables), count):
        loops = Loops.of(tables[start : start + count], grid_size)
        for figures, designed in zip(parts, designs, strict=True):
            figures.append(loop_figures(loops, np.array([designed.gains])))
        progress(min((start + count) / len(tables), 1.0))
    return [_outcome(joined(figures), designed.bounds) for figures, designed in zip(parts, designs, strict=True)]


def _outcome(figures: LoopFigures, bounds: tuple[Bound, ...]) -> Outcome:
    kept = np.array([figures.stable & (bound.excess(figures) <= 0.0) for bound in bounds])
    shares = tuple((bound, float(row.mean())) for bound, row in zip(bounds, kept, strict=True))
    return Outcome(figures, shares, float(kept.all(axis=0).mean()), float(figures.stable.mean()))


def _scaled(config: TableConfig, factors: Array) -> TableConfig:
    changes: dict[str, dict[str, Any]] = {}
    for (section, key), factor in zip(SPREAD_KEYS, factors, strict=True):
        value = getattr(getattr(config, section), key) * float(factor)
        changes.setdefault(section, {})[key] = min(value, 1.0) if key == "efficiency" else value
    sections: dict[str, Any] = {name: replace(getattr(config, name), **values) for name, values in changes.items()}
    return replace(config, **sections)
