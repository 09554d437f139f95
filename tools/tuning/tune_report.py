"""The report of a tuning: what came out, why it is bounded there, and how model and emulator agree."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure as Drawing

from emulator.pid import Gains
from tools.html_report import (
    BLUE,
    GREEN,
    GREY,
    ORANGE,
    RED,
    figure_block,
    heading,
    new_figure,
    page,
    paragraph,
    svg_of,
    table_block,
)
from tools.tuning.bounds import Bound
from tools.tuning.checks import Check, Figure
from tools.tuning.frequency_response import Complex
from tools.tuning.linear_model import Teeth, duty_gains, quantisation_noise, speed_quantum_deg_s
from tools.tuning.loop_figures import LoopFigures, Loops
from tools.tuning.margins import controller
from tools.tuning.tuned_table import TunedSet, Tuning

_AGREES_SHARE = 0.2
_PLOT_GRID = 4096
_COLOURS = {Teeth.DRIVING: BLUE, Teeth.OVERHAULING: GREEN, Teeth.FREE: ORANGE}


def plots(tuning: Tuning) -> dict[str, str]:
    """Return the report's figures as SVG, by name."""
    drawings = {"answers": _answers, "bode": _bode, "nyquist": _nyquist, "spread": _spread_figure}
    return {name: svg_of(draw(tuning)) for name, draw in drawings.items()}


def tune_report(tuning: Tuning, drawings: dict[str, str]) -> str:
    """Return the report as HTML, with the figures of `plots` in it."""
    ramp, hold = tuning.sets["ramp"], tuning.sets["hold"]
    blocks = [paragraph(_summary(tuning), "lead"), heading("Gains"), _gains_table(tuning)]
    blocks += [
        paragraph(
            "u = K (e + integral(e) / Ti - Td d(speed)/dt), in the registers of the firmware; these are judged below.",
            "quiet",
        ),
        heading("Figures of the linear loop, and their bounds"),
        paragraph(
            "Margins and noise are the worst of three states: the motor drives the table, the table drives "
            "the motor, the load is free within the backlash."
        ),
    ]
    for tuned in (ramp, hold):
        blocks += [_figures_table(tuned), paragraph(_binding(tuned))]
    blocks += [
        heading("On the emulator"),
        paragraph(
            "The full table, with friction, stiction, backlash and quantisation, beside what the linear model "
            "foretells. Steps are the mean of runs from many places between two counts."
        ),
        _checks_table(tuning),
        *[paragraph(text, "quiet") for text in _differences(tuning)],
        figure_block(
            drawings["answers"],
            "Answers in time: tuned and former gains on the emulator, and the linear model with the tuned gains.",
        ),
        heading("Frequency response"),
        figure_block(drawings["bode"], "Bode plots of the loop, in each state of the backlash."),
        figure_block(drawings["nyquist"], "Nyquist plots; the circle is what the bound on Ms keeps free about -1."),
        heading("Spread of the plant"),
        paragraph(
            f"{tuning.plants} tables whose constants lie uniformly within "
            f"{100 * tuning.spread:.0f} % about the configured ones."
        ),
        _spread_table(tuning),
        figure_block(
            drawings["spread"],
            "The worst Ms of each table, over the states of the backlash; the line is the bound for the nominal table.",
        ),
        heading("What the model takes as noise"),
        paragraph(_noise(tuning)),
    ]
    return page("Gain tuning", blocks)


def _summary(tuning: Tuning) -> str:
    parts = [f"{tuned.title}: bounded by {_names(tuned.design.binding)}" for tuned in tuning.sets.values()]
    figures = [pair for before, after in tuning.checks for pair in zip(before.figures, after.figures, strict=True)]
    better = sum(new.emulator <= old.emulator for old, new in figures)
    return (
        f"Both sets keep all bounds ({'; '.join(parts)}). On the emulator {better} of {len(figures)} figures are "
        "as good as before or better."
    )


def _gains_table(tuning: Tuning) -> str:
    rows: list[tuple[str, ...]] = []
    for tuned in tuning.sets.values():
        for when, gains in (("before", tuned.before), ("tuned", tuned.design.gains)):
            rows.append((f"{tuned.title}, {when}", *_gain_cells(tuning, gains)))
    head = ("", "K, duty s/deg", "Ti, ms", "Td, ms", "proportional", "integral", "derivative")
    return table_block(head, rows)


def _gain_cells(tuning: Tuning, gains: Gains) -> tuple[str, ...]:
    proportional, integral, derivative = duty_gains(tuning.before, gains)
    tick_ms = 1e3 / tuning.before.control.tick_hz
    times = (proportional / integral * tick_ms, derivative / proportional * tick_ms)
    return (f"{proportional:.5f}", *(f"{time:.3f}" for time in times), *map(str, gains))


def _figures_table(tuned: TunedSet) -> str:
    rows: list[tuple[str, ...]] = []
    for bound in tuned.design.bounds:
        after = _judged(bound, tuned.design.figures) + (" (binding)" if bound in tuned.design.binding else "")
        rows.append((bound.title, _limit(bound), _judged(bound, tuned.before_figures), after))
    for title, field, scale, unit in (
        ("lag on a ramp, speed error over acceleration", "ramp_lag_s", 1e3, " ms"),
        ("peak after a load step", "load_peak_deg_s_Nm", 1.0, " deg/s per Nm"),
    ):
        values = [
            f"{float(getattr(figures, field)[0]) * scale:.3g}{unit}"
            for figures in (tuned.before_figures, tuned.design.figures)
        ]
        rows.append((title, "", *values))
    return table_block((tuned.title, "bound", "before", "tuned"), rows)


def _limit(bound: Bound) -> str:
    return f"{'<=' if bound.at_most else '>='} {bound.shown(bound.limit)}"


def _judged(bound: Bound, figures: LoopFigures) -> str:
    value = bound.shown(float(getattr(figures, bound.figure)[0]))
    return value if bound.excess(figures)[0] <= 0.0 else f"!{value}"


def _names(bounds: tuple[Bound, ...]) -> str:
    return " and ".join(bound.title for bound in bounds) or "none of the bounds"


def _binding(tuned: TunedSet) -> str:
    return f"Binding for the {tuned.title}: {_names(tuned.design.binding)}."


def _checks_table(tuning: Tuning) -> str:
    rows: list[tuple[str, ...]] = []
    for before, after in tuning.checks:
        for old, new in zip(before.figures, after.figures, strict=True):
            mark = "+" if new.emulator < old.emulator else "!" if new.emulator > 1.001 * old.emulator else ""
            model = "" if new.model is None else f"{new.model:.3g}"
            rows.append(
                (
                    f"{new.title}, {new.unit}",
                    f"{old.emulator:.3g}",
                    f"{mark}{new.emulator:.3g}",
                    model,
                    _difference(new),
                )
            )
    return table_block(("figure", "before", "tuned", "model", "emulator to model"), rows)


def _difference(figure: Figure) -> str:
    if figure.model is None or figure.model == 0.0:
        return ""
    share = figure.emulator / figure.model - 1.0
    return f"{'' if abs(share) <= _AGREES_SHARE else '!'}{100 * share:+.0f} %"


def _differences(tuning: Tuning) -> list[str]:
    """Explain each figure in which emulator and model differ by more than a fifth."""
    quantum = speed_quantum_deg_s(tuning.before)
    return [
        f"{figure.title}: {figure.emulator:.3g} {figure.unit} where the model foretells {figure.model:.3g}. The model "
        f"has neither stiction nor backlash, and the firmware sees the speed in quanta of {quantum:.3g} deg/s, so "
        "answers smaller than some quanta are not linear."
        for _, after in tuning.checks
        for figure in after.figures
        if figure.model is not None and abs(figure.emulator - figure.model) > _AGREES_SHARE * abs(figure.model)
    ]


def _answers(tuning: Tuning) -> Drawing:
    drawing = new_figure(10.5, 8.6, rows=3, columns=2)
    for axes, (before, after) in zip(drawing.axes, tuning.checks, strict=True):
        _draw_check(axes, before, after)
    drawing.axes[0].legend(loc="best")
    return drawing


def _draw_check(axes: Axes, before: Check, after: Check) -> None:
    axes.plot(before.curve.time_s, before.curve.emulator, color=GREY, linewidth=1.0, label="emulator, former gains")
    axes.plot(after.curve.time_s, after.curve.emulator, color=BLUE, linewidth=1.2, label="emulator, tuned gains")
    if after.curve.model is not None:
        axes.plot(
            after.curve.time_s,
            after.curve.model,
            color=ORANGE,
            linewidth=1.3,
            linestyle="--",
            label="model, tuned gains",
        )
    axes.set_title(after.name)
    axes.set_ylabel(after.ordinate)
    axes.set_xlabel("time, s")
    if "step" in after.name:
        axes.set_xlim(-0.02, 0.15)


def _loops(tuning: Tuning, gains: Gains) -> tuple[Loops, dict[Teeth, Complex]]:
    loops = Loops.of([tuning.before], _PLOT_GRID)
    regulator = controller(duty_gains(tuning.before, np.array([gains])), loops.z)
    return loops, {teeth: (regulator.by_measured * plant.measured_by_duty)[0] for teeth, plant in loops.plants.items()}


def _bode(tuning: Tuning) -> Drawing:
    drawing = new_figure(10.5, 5.4, rows=2, columns=2)
    for column, tuned in enumerate(tuning.sets.values()):
        loops, responses = _loops(tuning, tuned.design.gains)
        size, phase = drawing.axes[column], drawing.axes[column + 2]
        for teeth, response in responses.items():
            size.semilogx(
                loops.frequency_hz, 20.0 * np.log10(np.abs(response)), color=_COLOURS[teeth], label=str(teeth)
            )
            phase.semilogx(loops.frequency_hz, np.degrees(np.unwrap(np.angle(response))), color=_COLOURS[teeth])
        size.axhline(0.0, color=GREY, linewidth=0.8)
        phase.axhline(-180.0, color=GREY, linewidth=0.8)
        size.set(title=tuned.title, ylabel="gain, dB", ylim=(-40, 40))
        phase.set(ylabel="phase, deg", xlabel="frequency, Hz", ylim=(-540, 0))
        size.legend(loc="lower left")
    return drawing


def _nyquist(tuning: Tuning) -> Drawing:
    drawing = new_figure(10.5, 5.2, columns=2)
    turn = np.exp(1j * np.linspace(0.0, 2.0 * np.pi, 200))
    for axes, tuned in zip(drawing.axes, tuning.sets.values(), strict=True):
        _, responses = _loops(tuning, tuned.design.gains)
        for teeth, response in responses.items():
            axes.plot(response.real, response.imag, color=_COLOURS[teeth], label=str(teeth))
        limit = next(bound.limit for bound in tuned.design.bounds if bound.figure == "sensitivity_peak")
        circle = -1.0 + turn / limit
        axes.fill(circle.real, circle.imag, color=RED, alpha=0.12, linewidth=0)
        axes.plot(circle.real, circle.imag, color=RED, linewidth=1.0, label=f"Ms = {limit:g}")
        axes.plot(-1.0, 0.0, "+", color=RED)
        axes.set(
            title=tuned.title, xlim=(-2.0, 1.0), ylim=(-2.0, 1.0), aspect="equal", xlabel="real", ylabel="imaginary"
        )
        axes.legend(loc="lower right")
    return drawing


def _spread_table(tuning: Tuning) -> str:
    ramp, hold = (tuned.spread for tuned in tuning.sets.values())
    shares = dict(ramp.shares)
    rows: list[tuple[str, ...]] = [
        (str(bound), f"{100 * shares[bound]:.1f} %" if bound in shares else "not asked", f"{100 * share:.1f} %")
        for bound, share in hold.shares
    ]
    rows.append(("all bounds", *(f"{100 * outcome.all_share:.1f} %" for outcome in (ramp, hold))))
    rows.append(("stable", *(f"{100 * outcome.stable_share:.1f} %" for outcome in (ramp, hold))))
    for percent in (50, 95, 100):
        values = [np.percentile(outcome.figures.sensitivity_peak, percent) for outcome in (ramp, hold)]
        rows.append((f"Ms of {percent} % of the tables is at most", *(f"{value:.2f}" for value in values)))
    return table_block(("share of the tables that meet", "ramp set", "constant-speed set"), rows)


def _spread_figure(tuning: Tuning) -> Drawing:
    drawing = new_figure(10.5, 2.7, columns=2)
    for axes, tuned in zip(drawing.axes, tuning.sets.values(), strict=True):
        axes.hist(tuned.spread.figures.sensitivity_peak, bins=40, color=BLUE, alpha=0.85)
        axes.axvline(
            next(bound.limit for bound in tuned.design.bounds if bound.figure == "sensitivity_peak"), color=RED
        )
        axes.set(title=tuned.title, xlabel="Ms", ylabel="tables")
    return drawing


def _noise(tuning: Tuning) -> str:
    count_deg, duty = quantisation_noise(tuning.before)
    return (
        f"The position is rounded to counts, a white noise of {count_deg:.2g} deg (standard "
        "deviation), which the regulator turns into the noise at the PWM that is bounded above. The PWM is rounded to "
        f"steps, a white noise of {100 * duty:.2g} % duty at the plant's input."
    )
