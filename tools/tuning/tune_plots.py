"""The figures of a tuning report: responses over time, Bode and Nyquist plots, the spread of Ms."""

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure as Drawing

from emulator.firmware.pid import Gains
from planner.plot_style import AMBER, BLUE, GREEN, LIMIT, VERMILION, new_figure, styled, svg_of
from tools.tuning.check import Check
from tools.tuning.frequency_response import Complex
from tools.tuning.linear_model import Teeth, duty_gains
from tools.tuning.loop_figures import Loops
from tools.tuning.margins import controller
from tools.tuning.tuned_table import Tuning, Words

_CREEP_S = 0.25
"""Drawn time of the creep: over a longer time the curves are not distinguishable."""
_PLOT_GRID = 4096
_TITLES = {
    Teeth.DRIVING: "motor drives table",
    Teeth.OVERHAULING: "table drives motor",
    Teeth.FREE: "free in the backlash",
}
_LINES: dict[Teeth, Any] = {  # distinguishable without color too, and where they overlap
    Teeth.DRIVING: {"color": BLUE, "linewidth": 2.4},
    Teeth.OVERHAULING: {"color": GREEN, "linestyle": "--"},
    Teeth.FREE: {"color": AMBER, "linestyle": ":", "linewidth": 2.0},
}
_AFTER: Any = {"color": BLUE, "linewidth": 1.6}
_BEFORE: Any = {"color": VERMILION, "linewidth": 1.1, "linestyle": (0, (5, 2))}
_MODEL: Any = {"color": "black", "linewidth": 1.3, "linestyle": (0, (1, 1.6))}


@styled()
def plots(tuning: Tuning) -> dict[str, str]:
    """Return the report's figures as SVG, by name."""
    drawings = {"answers": _answers, "bode": _bode, "nyquist": _nyquist, "spread": _spread_figure}
    return {name: svg_of(draw(tuning)) for name, draw in drawings.items()}


def _answers(tuning: Tuning) -> Drawing:
    drawing = new_figure(11.2)
    drawing.subplots((len(tuning.checks) + 1) // 2, 2)
    for axes, (before, after) in zip(drawing.axes, tuning.checks, strict=False):
        _draw_check(axes, before, after, tuning.words)
    for axes in drawing.axes[len(tuning.checks) :]:
        axes.set_visible(False)
    curves = {
        label: line for axes in drawing.axes for line, label in zip(*axes.get_legend_handles_labels(), strict=True)
    }
    drawing.legend(list(curves.values()), list(curves), loc="outside upper center", ncols=3, handlelength=3.5)
    return drawing


def _draw_check(axes: Axes, before: Check, after: Check, words: Words) -> None:
    for check, word, style in ((after, words.after, _AFTER), (before, words.before, _BEFORE)):
        axes.plot(check.curve.time_s, check.curve.emulator, **style, label=f"emulator, {word} gains")
    if after.curve.model is not None:
        axes.plot(after.curve.time_s, after.curve.model, **_MODEL, label=f"linear model, {words.after} gains")
    axes.set_title(after.title)
    axes.set_ylabel(after.ordinate)
    axes.set_xlabel("time (s)")
    if after.key in ("step", "load_step"):
        axes.set_xlim(-0.02, 0.15)
    if after.key == "creep":
        axes.set_xlim(after.curve.time_s[-1] - _CREEP_S, after.curve.time_s[-1])


def _loops(tuning: Tuning, gains: Gains) -> tuple[Loops, dict[Teeth, Complex]]:
    loops = Loops.of([tuning.before], _PLOT_GRID)
    regulator = controller(duty_gains(tuning.before, np.array([gains])), loops.z)
    return loops, {teeth: (regulator.by_measured * plant.measured_by_duty)[0] for teeth, plant in loops.plants.items()}


def _bode(tuning: Tuning) -> Drawing:
    drawing = new_figure(5.4)
    drawing.subplots(2, 2)
    control = tuning.before.control
    for column, tuned in enumerate(tuning.sets.values()):
        loops, responses = _loops(tuning, tuned.design.gains)
        size, phase = drawing.axes[column], drawing.axes[column + 2]
        seen = (
            loops.frequency_hz < control.tick_hz / control.speed_window_ticks
        )  # first zero of the response of the window
        for teeth, response in responses.items():
            size.semilogx(loops.frequency_hz, 20.0 * np.log10(np.abs(response)), **_LINES[teeth], label=_TITLES[teeth])
            phase.semilogx(loops.frequency_hz[seen], np.degrees(np.unwrap(np.angle(response[seen]))), **_LINES[teeth])
        size.axhline(0.0, **LIMIT)
        phase.axhline(-180.0, **LIMIT)
        size.set(title=tuned.title, ylabel="gain (dB)", ylim=(-40, 40))
        phase.set(ylabel="phase (deg)", xlabel="frequency (Hz)", ylim=(-360, 0), xlim=size.get_xlim())
        size.legend(loc="lower left")
    return drawing


def _nyquist(tuning: Tuning) -> Drawing:
    drawing = new_figure(5.2)
    drawing.subplots(1, 2)
    turn = np.exp(1j * np.linspace(0.0, 2.0 * np.pi, 200))
    for axes, tuned in zip(drawing.axes, tuning.sets.values(), strict=True):
        _, responses = _loops(tuning, tuned.design.gains)
        for teeth, response in responses.items():
            axes.plot(response.real, response.imag, **_LINES[teeth], label=_TITLES[teeth])
        limit = next(bound.limit for bound in tuned.design.bounds if bound.figure == "sensitivity_peak")
        circle = -1.0 + turn / limit
        axes.fill(circle.real, circle.imag, color=VERMILION, alpha=0.12, linewidth=0)
        axes.plot(circle.real, circle.imag, color=VERMILION, linewidth=1.0, label=f"Ms = {limit:g}")
        axes.plot(-1.0, 0.0, "+", color=VERMILION)
        axes.set(
            title=tuned.title, xlim=(-2.0, 1.0), ylim=(-2.0, 1.0), aspect="equal", xlabel="real", ylabel="imaginary"
        )
    drawing.legend(*drawing.axes[0].get_legend_handles_labels(), loc="outside lower center", ncols=4)
    return drawing


def _spread_figure(tuning: Tuning) -> Drawing:
    drawing = new_figure(2.7)
    drawing.subplots(1, 2)
    for axes, tuned in zip(drawing.axes, tuning.sets.values(), strict=True):
        axes.hist(tuned.spread.figures.sensitivity_peak, bins=40, color=BLUE, alpha=0.85)
        axes.axvline(
            next(bound.limit for bound in tuned.design.bounds if bound.figure == "sensitivity_peak"), color=VERMILION
        )
        axes.set(title=tuned.title, xlabel="Ms", ylabel="tables")
    return drawing
