"""The report of a tuning: the results, their binding bounds, and the agreement of model and emulator."""

import numpy as np

from emulator.firmware.pid import Gains
from protocol.program.page import Cell, Kind, Marked, Origin, details, figure, heading, page, paragraph, table
from protocol.program.page import verdict as headline
from tools.bounds import Bound
from tools.tuning.check import Figure
from tools.tuning.checks import differs
from tools.tuning.comparison_report import textbook_table, trade_table
from tools.tuning.gain_design import Design
from tools.tuning.linear_model import duty_gains, quantization_noise, speed_quantum_deg_s
from tools.tuning.loop_figures import LoopFigures
from tools.tuning.tuned_table import JUDGED, TunedSet, Tuning, Words
from tools.tuning.way_out import changes

_SAME_SHARE = 0.05
"""Emulator results with a smaller difference count as equal: the position of the counts has this effect."""


def tune_report(tuning: Tuning, drawings: dict[str, str], origin: Origin | None = None) -> str:
    """Return the report as HTML, with the figures of `tune_plots.plots` in it."""
    return page(
        "Gain tuning",
        [
            headline(_summary(tuning), tuning.feasible),
            *_gains_section(tuning),
            *_linear_section(tuning),
            *_emulator_section(tuning, drawings),
            heading("In detail"),
            details("Frequency response", _frequency_section(drawings)),
            details("Spread of the plant", _spread_section(tuning, drawings)),
            details("What the bound on the noise costs", _trade_section(tuning)),
            details("Textbook rules", _textbook_section(tuning)),
            details("Quantization noise in the model", paragraph(_noise(tuning))),
        ],
        origin,
    )


def _summary(tuning: Tuning) -> str:
    figures = [pair for before, after in tuning.checks for pair in zip(before.figures, after.figures, strict=True)]
    better = sum(not _is_worse(old, new) for old, new in figures)
    old, new = max(figures, key=lambda pair: pair[1].emulator / pair[0].emulator if pair[0].emulator > 0.0 else 0.0)
    worst = f" The worst is {new.title}: {_change(old.emulator, new.emulator)}." if _is_worse(old, new) else ""
    return (
        f"{verdict(tuning)} On the emulator {better} of {len(figures)} figures are as good as with the "
        f"{tuning.words.before} gains, within {100 * _SAME_SHARE:.0f} %, or better.{worst}"
    )


def _change(old: float, new: float) -> str:
    """Return by how much a figure changed, in percent of what it was."""
    if not (old > 0.0 and np.isfinite((old, new)).all()):
        return ""
    percent = round(100.0 * (new / old - 1.0))
    return f"{percent:+d} %" if percent else "0 %"


def verdict(tuning: Tuning) -> str:
    """Return in a sentence whether the bounds are satisfied: which are binding, or which are violated and by what."""
    if tuning.feasible:
        parts = [f"{tuned.title}: bounded by {_names(tuned.design.binding)}" for tuned in tuning.sets.values()]
        return f"Both sets satisfy all bounds ({'; '.join(parts)})."
    parts = [f"the {tuned.title} {_broken(tuned.design)}" for tuned in tuning.sets.values() if tuned.design.broken]
    if tuning.words == JUDGED:
        return f"Not all bounds are satisfied: {'; '.join(parts)}."
    way = ""
    if tuning.eased is not None:
        options = " ".join(after.option for _, after in changes(tuning.limits, tuning.eased))
        way = f" With {options} both sets satisfy all bounds."
    return f"No gains satisfy all bounds: {'; '.join(parts)}.{way} This report judges the nearest gains."


def _broken(design: Design) -> str:
    if not design.figures.stable[0]:
        return "is not stable"
    return f"breaks {', '.join(map(design.stated, design.broken))}"


def _gains_section(tuning: Tuning) -> list[str]:
    text = "u = K (e + integral(e) / Ti - Td d(speed)/dt), in the registers of the firmware; these are judged below."
    return [heading("Gains"), _gains_table(tuning), paragraph(text)]


def _linear_section(tuning: Tuning) -> list[str]:
    blocks = [
        heading("Figures of the linear loop, and their bounds"),
        paragraph(
            "Margins and noise are the worst of three states: the motor drives the table, the table drives "
            "the motor, the load is free within the backlash. Answers are those of a table that is driven. The noise "
            "is that of the worst constant speed; a ramp passes all speeds, and its noise is their mean."
        ),
    ]
    for tuned in tuning.sets.values():
        blocks.append(_figures_table(tuned, tuning.words))
        if not tuned.design.broken:
            blocks.append(paragraph(f"Binding for the {tuned.title}: {_names(tuned.design.binding)}."))
    return blocks


def _trade_section(tuning: Tuning) -> str:
    text = (
        "The best gains for other bounds on the noise, all other bounds as they are: lag of the ramp set, load "
        "peak of the constant-speed set, and the ripple of the table's speed at creep on the emulator."
    )
    return paragraph(text) + trade_table(tuning.trades, tuning.limits)


def _textbook_section(tuning: Tuning) -> str:
    text = (
        "Both tuned sets and the rules SIMC and AMIGO, for a process of first order with a delay, on the same "
        "figures. What breaks a bound of its set is marked; a rule is judged as a constant-speed set."
    )
    designs = {tuned.title: tuned.design for tuned in tuning.sets.values()} | tuning.textbook
    return paragraph(text) + textbook_table(designs, tuning.before)


def _emulator_section(tuning: Tuning, drawings: dict[str, str]) -> list[str]:
    return [
        heading("On the emulator"),
        paragraph(
            "The full table, with friction, stiction, backlash and quantization, and what the linear model "
            "predicts. Steps are the mean of runs from many places between two counts."
        ),
        _checks_table(tuning),
        *[paragraph(text) for text in _differences(tuning)],
        figure(
            drawings["answers"],
            "Responses in time of the emulator with both gain sets, and of the linear model.",
            f"Answers in time: {tuning.words.after} gains (solid) and {tuning.words.before} gains (dashed) on the "
            f"emulator, and the linear model with the {tuning.words.after} gains (dotted) where its loop is stable.",
        ),
    ]


def _frequency_section(drawings: dict[str, str]) -> str:
    return figure(
        drawings["bode"],
        "Gain and phase of the loop over frequency, for both gain sets.",
        "Bode plots of the loop, in each state of the backlash; the phase up to where the speed's window hides "
        "an oscillation.",
    ) + figure(
        drawings["nyquist"],
        "The loop in the complex plane, for both gain sets.",
        "Nyquist plots; the circle around -1 is excluded by the bound on Ms.",
    )


def _spread_section(tuning: Tuning, drawings: dict[str, str]) -> str:
    text = (
        f"{tuning.plants:,} tables whose constants are uniformly distributed within "
        f"{100 * tuning.spread:.0f} % about the configured ones."
    )
    caption = (
        "The worst Ms of each table, over the states of the backlash; the line is the bound for the nominal table."
    )
    histogram = figure(drawings["spread"], "Histogram of Ms over the tables, for both gain sets.", caption)
    return paragraph(text) + _spread_table(tuning) + histogram


def _gains_table(tuning: Tuning) -> str:
    rows: list[tuple[str, ...]] = []
    for tuned in tuning.sets.values():
        for when, gains in zip(tuning.words, (tuned.before, tuned.design.gains), strict=True):
            rows.append((f"{tuned.title}, {when}", *_gain_cells(tuning, gains)))
    head = ("", "K (duty s/deg)", "Ti (ms)", "Td (ms)", "P register", "I register", "D register")
    return table(head, rows)


def _gain_cells(tuning: Tuning, gains: Gains) -> tuple[str, ...]:
    proportional, integral, derivative = duty_gains(tuning.before, gains)
    tick_ms = 1e3 / tuning.before.control.tick_hz
    times = (proportional / integral * tick_ms, derivative / proportional * tick_ms)
    return (f"{proportional:.5f}", *(f"{time:.3f}" for time in times), *map(str, gains))


def _figures_table(tuned: TunedSet, words: Words) -> str:
    rows: list[tuple[Cell, ...]] = []
    for bound in tuned.design.bounds:
        binding = bound in tuned.design.binding and bound not in tuned.design.broken
        limit = f"{'<=' if bound.at_most else '>='} {bound.shown(bound.limit)}{' (binding)' if binding else ''}"
        judged = (_judged(bound, figures) for figures in (tuned.before_figures, tuned.design.figures))
        rows.append((bound.title, limit, *judged, _field_change(tuned, bound.figure)))
    bounded = {bound.figure for bound in tuned.design.bounds}
    for title, field, scale, unit in (
        ("noise at the PWM on a ramp", "ramp_noise_duty", 100.0, " % duty"),
        ("overshoot after a step", "overshoot", 100.0, " %"),
        ("settling after a step", "settling_s", 1e3, " ms"),
        ("lag on a ramp", "ramp_lag_s", 1e3, " ms"),
        ("peak after a load step", "load_peak_deg_s_Nm", 1.0, " deg/s per Nm"),
    ):
        if field in bounded:
            continue
        values = [
            f"{float(getattr(figures, field)[0]) * scale:.3g}{unit}" if figures.stable[0] else ""
            for figures in (tuned.before_figures, tuned.design.figures)
        ]
        rows.append((title, "", *values, _field_change(tuned, field)))
    return table((tuned.title, "bound", *words, "change"), rows)


def _field_change(tuned: TunedSet, field: str) -> str:
    old, new = tuned.before_figures, tuned.design.figures
    if not (old.stable[0] and new.stable[0]):
        return ""
    return _change(float(getattr(old, field)[0]), float(getattr(new, field)[0]))


def _judged(bound: Bound, figures: LoopFigures) -> Cell:
    if not figures.stable[0]:
        return Marked("not stable", "bad")
    value = bound.shown(float(getattr(figures, bound.figure)[0]))
    return value if bound.excess(figures)[0] <= 0.0 else Marked(value, "bad")


def _names(bounds: tuple[Bound, ...]) -> str:
    return " and ".join(bound.title for bound in bounds) or "none of the bounds"


def _checks_table(tuning: Tuning) -> str:
    rows: list[tuple[Cell, ...]] = []
    for before, after in tuning.checks:
        for old, new in zip(before.figures, after.figures, strict=True):
            text = _change(old.emulator, new.emulator)
            kind: Kind | None = "good" if _is_worse(new, old) else "bad" if _is_worse(old, new) else None
            change = text if kind is None else Marked(text, kind)
            model = "" if new.model is None else f"{new.model:.3g}"
            values = (f"{each.emulator:.3g}" for each in (old, new))
            rows.append((f"{new.title} ({new.unit})", *values, change, model, _difference(new)))
    return table(("figure", *tuning.words, "change", "model", "emulator to model"), rows)


def _is_worse(old: Figure, new: Figure) -> bool:
    return new.emulator > (1.0 + _SAME_SHARE) * old.emulator


def _difference(figure: Figure) -> Cell:
    if figure.model is None or figure.model == 0.0:
        return ""
    share = figure.emulator / figure.model - 1.0
    percent = f"{abs(100 * share):.0f} %"
    more_or_less = percent if percent == "0 %" else f"{percent} {'more' if share > 0.0 else 'less'}"
    return Marked(more_or_less, "bad") if differs(figure) else more_or_less


def _differences(tuning: Tuning) -> list[str]:
    """Explain each figure in which emulator and model differ by more than a fifth."""
    quantum = speed_quantum_deg_s(tuning.before)
    texts = []
    for differing, without in tuning.differences:
        others = ", ".join(f"{value:.3g} without {effect}" for effect, value in without.items())
        texts.append(
            f"{differing.title}: {differing.emulator:.3g} {differing.unit}; the model predicts {differing.model:.3g}."
            f" On the emulator it would be {others}. The remaining differences are due to the rounding of the speed"
            f" to steps of {quantum:.3g} deg/s and of the PWM. Other causes are the dry friction of a table that stops"
            " or reverses, and a duty at its limit."
        )
    return texts


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
    return table(("share of the tables that meet", "ramp set", "constant-speed set"), rows)


def _noise(tuning: Tuning) -> str:
    count_deg, duty = quantization_noise(tuning.before)
    return (
        f"The position is rounded to counts, a white noise of {count_deg:.2g} deg (standard "
        "deviation). The PID turns it into the noise at the PWM on a ramp. At a constant speed the rounding "
        "repeats, and is a sawtooth instead: the bound holds for the worst speed. The PWM is rounded to "
        f"steps, a white noise of {100 * duty:.2g} % duty at the plant's input."
    )
