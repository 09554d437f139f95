"""The HTML page of a run: verdict, figures, pictures as inline SVG, and all commands."""

from collections.abc import Iterator, Sequence
from pathlib import Path

from planner.execution.run_file import StoredRun, load_run
from planner.execution.run_plots import deviation_figure, map_figure, motion_figure
from planner.execution.run_verification import RunVerification, verify_run
from planner.plot_style import svg_of
from protocol.files.whole_file import write_whole
from protocol.program import page as html
from protocol.program.page import Origin, counted, details, figure, heading, paragraph, table, verdict

_NAMES = {
    "encoder": "encoder",
    "latch": "encoder, latched at the trigger (L)",
    "reading": "encoder, polled (H)",
    "reference": "reference, against the plan as commanded",
    "true": "true angle of the table",
}


def write_report(folder: Path, page: Path, command: str = "", further: Sequence[str] = ()) -> None:
    """Write the page of the run that a folder holds; `command` is the command line that asks for it.

    Further blocks come after the summary.

    Raises:
        PlannerError: the folder holds no run, or it is damaged.
        OSError: the page cannot be written.
    """
    run = load_run(folder)
    conditions = run.conditions
    checked = verify_run(run.run_input, run.motion, run.record, conditions.lead_s, conditions.tolerance_deg)
    write_whole(page, run_report(run, checked, command, further))


def run_report(run: StoredRun, checked: RunVerification, command: str = "", further: Sequence[str] = ()) -> str:
    """Return the page of a run with further blocks; `command` is the command line that asks for it."""
    wire = run.conditions.wire
    blocks = (
        verdict(checked.verdict, checked.is_verified),
        table(("", ""), list(_summary(run, checked)), words=True),
        *further,
        heading("On the configuration map"),
        paragraph("Gray is allowed (lighter is better); colors are forbidden. Both paths wrap at 360 deg."),
        figure(svg_of(map_figure(run, checked)), "Configuration map with the planned and the executed path."),
        heading("Motion"),
        figure(svg_of(motion_figure(run)), "Planned and executed angle and speed of the table over time."),
        heading("Deviation from the plan"),
        paragraph(
            "The dashed lines show the tolerance at the scan locations."
            f" L and H carry {counted(wire.decimals, 'decimal')}:"
            f" up to {0.5 * wire.quantum:g} deg of their deviation is rounding."
            " The true angle differs from the encoder's by the backlash of the gears."
        ),
        figure(
            svg_of(deviation_figure(run, checked)),
            f"Executed minus planned angle over time; {checked.worst_deg:.3f} deg at most at the locations.",
        ),
        table(("", "at the locations (deg)", "anywhere (deg)", "rms (deg)"), list(_deviations(checked))),
        heading("Cost, Eq. (7)"),
        table(("", "acceleration", "speed", "value", "pauses", "total"), list(_costs(checked))),
        heading("Commands"),
        details(f"all {counted(len(run.record.sent), 'motion command')}", _commands(run)),
        _corrections(run),
    )
    return html.page(f"Run of {run.run_input.name}", blocks, Origin(command, run.conditions.begun))


def _summary(run: StoredRun, checked: RunVerification) -> Iterator[tuple[str, str]]:
    plan, conditions = run.run_input.plan, run.conditions
    yield "planned by", f"{plan.planner}, {plan.configuration}"
    yield "locations", f"{len(plan.angles_deg)}, one every {plan.step_s:g} s, {counted(len(plan.pauses), 'pause')}"
    yield "port", f"{conditions.port}, {conditions.wire.baud} baud, {counted(conditions.wire.decimals, 'decimal')}"
    yield "encoder at the locations", f"{checked.worst_deg:.3f} deg at most, {checked.tolerance_deg:g} allowed"
    yield "forbidden cells touched in", counted(len(checked.forbidden_steps), "step")
    yield "margin left to a forbidden cell", f"{checked.margin_deg:.2f} deg"
    yield "latest command", f"{1000.0 * checked.latest_command_s:.1f} ms late"
    yield "locations without a trigger", f"{len(checked.missing_triggers)}"
    if conditions.turns:
        yield "full turns added to the plan", f"{conditions.turns}, to start where the table stood"
    yield "commands sent ahead by", f"{1000.0 * conditions.lead_s:g} ms"
    if run.record.sent:
        yield "if the line had failed", f"{checked.dead_line}"


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
    return table(("time (s)", "phase", "location", "A (deg/s2)", "S (deg/s)", "P (deg)", "late (ms)"), rows)


def _corrections(run: StoredRun) -> str:
    corrections = run.record.corrections
    if not corrections:
        return paragraph("No drift and no late command had to be corrected.")
    times = ", ".join(f"{each.time_s:.1f} s ({each.slip_deg:+.2f} deg)" for each in corrections)
    return paragraph(f"Because of drift or a late command, the stream was computed again at {times}.")
