"""The results of a tuning for programs: each figure under its key."""

import json
from math import isfinite
from typing import Any

from emulator.firmware.pid import Gains
from tools.tuning.check import Figure
from tools.tuning.gain_files import gains_config
from tools.tuning.tuned_table import TunedSet, Tuning


def figures_json(tuning: Tuning) -> str:
    """Return gains, linear figures with bounds, and emulator checks as JSON; a figure without a value is null."""
    document = {
        "all_bounds_hold": tuning.feasible,
        "sets": {name: _set(tuning, tuned) for name, tuned in tuning.sets.items()},
        "checks": {
            check.key: {
                new.key: {"title": new.title, "unit": new.unit, "before": _answers(old), "after": _answers(new)}
                for old, new in zip(before.figures, check.figures, strict=True)
            }
            for before, check in tuning.checks
        },
    }
    return json.dumps(document, indent=2) + "\n"


def _set(tuning: Tuning, tuned: TunedSet) -> dict[str, Any]:
    design = tuned.design
    return {
        "before": _gains(tuning, tuned.before),
        "after": _gains(tuning, design.gains),
        "stable": bool(design.figures.stable[0]),
        "bounds": {
            bound.figure: {
                "limit": bound.limit,
                "at_most": bound.at_most,
                "before": _number(getattr(tuned.before_figures, bound.figure)[0]),
                "after": _number(getattr(design.figures, bound.figure)[0]) if design.figures.stable[0] else None,
                "holds": bound not in design.broken,
            }
            for bound in design.bounds
        },
    }


def _gains(tuning: Tuning, gains: Gains) -> dict[str, Any]:
    return {**vars(gains_config(tuning.before, gains)), "registers": gains._asdict()}


def _answers(figure: Figure) -> dict[str, float | None]:
    return {"emulator": _number(figure.emulator), "model": None if figure.model is None else _number(figure.model)}


def _number(value: float) -> float | None:
    return float(value) if isfinite(value) else None
