"""Comparison tables of a tuning report: bounds on the noise, and textbook rules."""

from collections.abc import Mapping, Sequence

from emulator.config.table_config import TableConfig
from protocol.program.page import Cell, Marked, table
from tools.bounds import Limits
from tools.tuning.gain_design import Design
from tools.tuning.linear_model import duty_gains
from tools.tuning.loop_figures import LoopFigures
from tools.tuning.trade_off import Trade

_FIGURES = (
    ("Ms", "sensitivity_peak", 1.0, ".2f"),
    ("gain margin (dB)", "gain_margin_db", 1.0, ".1f"),
    ("phase margin (deg)", "phase_margin_deg", 1.0, ".0f"),
    ("noise (% duty)", "noise_duty", 100.0, ".2f"),
    ("bandwidth (Hz)", "bandwidth_hz", 1.0, ".1f"),
    ("overshoot (%)", "overshoot", 100.0, ".1f"),
    ("settling (ms)", "settling_s", 1e3, ".0f"),
    ("lag on a ramp (ms)", "ramp_lag_s", 1e3, ".1f"),
    ("load peak (deg/s per Nm)", "load_peak_deg_s_Nm", 1.0, ".3f"),
)


def trade_table(trades: Sequence[Trade], limits: Limits) -> str:
    """Return the table of the results for each bound on the noise."""
    rows = [_trade_row(trade, limits) for trade in trades]
    head = ("--noise (% duty)", "lag on a ramp (ms)", "load peak (deg/s per Nm)", "creep ripple (deg/s)", "")
    return table(head, rows)


def textbook_table(designs: Mapping[str, Design], config: TableConfig) -> str:
    """Return the table of gain sets and their figures."""
    head = ("", "K (duty s/deg)", "Ti (ms)", "Td (ms)", *(title for title, *_ in _FIGURES))
    return table(head, [(name, *_gains(each, config), *_judged(each)) for name, each in designs.items()])


def _trade_row(trade: Trade, limits: Limits) -> tuple[Cell, ...]:
    note = "asked" if trade.noise_duty == limits.noise_duty else ""
    if not trade.feasible:
        broken = ", ".join(bound.title for bound in trade.designs.broken)
        return (f"{100 * trade.noise_duty:.3g}", "-", "-", "-", Marked(f"breaks {broken}", "bad"))
    lag_s, peak = trade.designs.ramp.figures.ramp_lag_s[0], trade.designs.hold.figures.load_peak_deg_s_Nm[0]
    return (
        f"{100 * trade.noise_duty:.3g}",
        f"{1e3 * lag_s:.2f}",
        f"{peak:.3f}",
        f"{trade.creep_ripple_deg_s:.3g}",
        note,
    )


def _gains(designed: Design, config: TableConfig) -> tuple[str, str, str]:
    proportional, integral, derivative = duty_gains(config, designed.gains)
    tick_ms = 1e3 / config.control.tick_hz
    times = (proportional / integral * tick_ms, derivative / proportional * tick_ms)
    return (f"{proportional:.5f}", *(f"{time:.2f}" for time in times))  # type: ignore[return-value]  # two times


def _judged(designed: Design) -> tuple[Cell, ...]:
    figures: LoopFigures = designed.figures
    if not figures.stable[0]:
        return (Marked("unstable", "bad"), *[""] * (len(_FIGURES) - 1))
    broken = {bound.figure for bound in designed.broken}
    cells = {field: f"{float(getattr(figures, field)[0]) * scale:{form}}" for _, field, scale, form in _FIGURES}
    return tuple(Marked(text, "bad") if field in broken else text for field, text in cells.items())
