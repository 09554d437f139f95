"""A run as one HTML file that needs nothing else: verdict, figures, pictures as inline SVG, and all commands."""

import io
from collections.abc import Iterator, Sequence
from html import escape

from matplotlib.figure import Figure

from planner.run_file import StoredRun
from planner.run_plots import deviation_figure, figure_style, map_figure, motion_figure
from planner.run_verification import RunVerification

_STYLE = """
body { font: 15px/1.5 system-ui, "Segoe UI", Helvetica, Arial, sans-serif; color: #23272d; background: #fff;
       max-width: 1020px; margin: 2.2em auto; padding: 0 1.4em; }
h1 { font-size: 1.6em; margin-bottom: .3em; }
h2 { font-size: 1.15em; margin: 2em 0 .5em; border-bottom: 1px solid #d5d9de; }
table { border-collapse: collapse; margin: .6em 0; font-variant-numeric: tabular-nums; }
th, td { padding: .22em 1.3em .22em 0; text-align: right; border-bottom: 1px solid #e8eaee; }
th:first-child, td:first-child { text-align: left; } th { color: #5a616a; font-weight: 600; }
.verdict { font-size: 1.15em; padding: .6em 1em; border-left: 5px solid; background: #f6f7f9; }
.good { border-color: #2e7d4f; } .bad { border-color: #b3362b; }
.note { color: #5a616a; max-width: 56em; }
figure { margin: .8em 0; } figure svg { width: 100%; height: auto; }
details { margin: .6em 0; } summary { cursor: pointer; color: #1f5fa8; }
"""
_NAMES = {
    "encoder": "encoder",
    "latch": "encoder, latched at the trigger (L)",
    "reading": "encoder, polled (H)",
    "reference": "reference, against the plan as commanded",
    "true": "true angle of the table",
}


def run_report(run: StoredRun, checked: RunVerification) -> str:
    """Return the page of a run."""
    title = f"Run of {run.run_input.name}"
    with figure_style():
        pictures = [_svg(map_figure(run, checked)), _svg(motion_figure(run)), _svg(deviation_figure(run, checked))]
    on_map, motion, deviation = (f"<figure>{picture}</figure>" for picture in pictures)
    blocks = (
        f"<h1>{escape(title)}</h1>",
        f'<p class="verdict {"good" if checked.is_verified else "bad"}">{escape(checked.verdict)}</p>',
        _table(("", ""), list(_summary(run, checked))),
        "<h2>On the configuration map</h2>",
        _note("Grey is allowed, the whiter the better; colours are forbidden. Both paths wrap at 360 degrees."),
        on_map,
        "<h2>Motion</h2>",
        motion,
        "<h2>Deviation from the plan</h2>",
        _note(
            "The dashed lines are the tolerance at the scan locations. L and H carry one decimal, so up to 0.05 deg of"
            " their deviation is rounding. The true angle differs from the encoder's by the backlash of the gears."
        ),
        deviation,
        _table(("in degrees", "at the locations", "anywhere", "rms"), list(_deviations(checked))),
        "<h2>Cost, Eq. (7)</h2>",
        _table(("", "acceleration", "speed", "value", "pauses", "total"), list(_costs(checked))),
        "<h2>Commands</h2>",
        f"<details><summary>all {len(run.record.sent)} motion commands</summary>{_commands(run)}</details>",
        _corrections(run),
    )
    body = "\n".join(blocks)
    return (
        f'<!DOCTYPE html>\n<html lang="en"><head><meta charset="utf-8"><title>{escape(title)}</title>'
        f"<style>{_STYLE}</style></head>\n<body>\n{body}\n</body></html>\n"
    )


def _summary(run: StoredRun, checked: RunVerification) -> Iterator[tuple[str, str]]:
    plan, conditions = run.run_input.plan, run.conditions
    yield "planned by", f"{plan.planner}, {plan.configuration}"
    yield "locations", f"{len(plan.angles_deg)}, one every {plan.step_s:g} s, {len(plan.pauses)} pauses"
    yield "port", f"{conditions.port}, {conditions.wire.baud} baud, {conditions.wire.decimals} decimal(s)"
    yield "encoder at the locations", f"{checked.worst_deg:.3f} deg off at most, {checked.tolerance_deg:g} allowed"
    yield "forbidden cells touched in", f"{len(checked.forbidden_steps)} steps"
    yield "margin left to a forbidden cell", f"{checked.margin_deg:.2f} deg"
    yield "latest command", f"{1000.0 * checked.latest_command_s:.1f} ms late"
    yield "locations without a trigger", f"{len(checked.missing_triggers)}"
    if conditions.turns:
        yield "full turns added to the plan", f"{conditions.turns}, to start where the table stood"
    yield "commands sent ahead by", f"{1000.0 * conditions.lead_s:g} ms"
    if run.record.sent:
        yield "if the line had died", f"at most {_longest_run_on_deg(run):.0f} deg until the table stood by itself"


def _longest_run_on_deg(run: StoredRun) -> float:
    return max(abs(sent.command.target_deg - run.motion.state_at(sent.time_s).angle_deg) for sent in run.record.sent)


def _deviations(checked: RunVerification) -> Iterator[tuple[str, ...]]:
    for name, text in _NAMES.items():
        if (each := checked.deviations.get(name)) is not None:
            yield text, f"{each.at_locations_deg:.4f}", f"{each.anywhere_deg:.4f}", f"{each.rms_deg:.4f}"


def _costs(checked: RunVerification) -> Iterator[tuple[str, ...]]:
    for name, cost in (("planned", checked.planned_cost), ("executed", checked.executed_cost)):
        if cost is not None:
            yield name, *(f"{term:.4f}" for term in (*cost, cost.total))


def _commands(run: StoredRun) -> str:
    rows = [
        (f"{sent.time_s:.3f}", sent.phase, f"{sent.column}", f"{command.acceleration_deg_s2:g}",
         f"{command.speed_deg_s:g}", f"{command.target_deg:g}", f"{1000.0 * sent.late_s:.1f}")
        for sent in run.record.sent
        for command in (sent.command,)
    ]  # fmt: skip
    return _table(("time (s)", "phase", "location", "A (deg/s2)", "S (deg/s)", "P (deg)", "late (ms)"), rows)


def _corrections(run: StoredRun) -> str:
    corrections = run.record.corrections
    if not corrections:
        return _note("Neither drift nor late commands had to be corrected.")
    times = ", ".join(f"{each.time_s:.1f} s ({each.slip_deg:+.2f} deg)" for each in corrections)
    return _note(f"For drift or a late command the stream was computed anew at {times}.")


def _svg(figure: Figure) -> str:
    text = io.StringIO()
    figure.savefig(text, format="svg", metadata={"Date": None})
    return text.getvalue()[text.getvalue().index("<svg") :]


def _note(text: str) -> str:
    return f'<p class="note">{escape(text)}</p>'


def _table(head: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    header = "<tr>" + "".join(f"<th>{escape(cell)}</th>" for cell in head) + "</tr>" if any(head) else ""
    lines = ["<tr>" + "".join(f"<td>{escape(cell)}</td>" for cell in row) + "</tr>" for row in rows]
    return "<table>" + header + "\n".join(lines) + "</table>"
