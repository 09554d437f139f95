"""`python -m planner new-scan`: write a scan file for a mesh, with a pattern that can be planned."""

import argparse
import sys
from dataclasses import replace
from pathlib import Path
from shlex import quote
from typing import NamedTuple

import numpy as np

from planner.cell.beam_check import beam_faults, beam_warning
from planner.cell.scan import check_it_fits_the_table
from planner.cell.scan_draft import Draft, Part, drafts
from planner.commands import options
from planner.defaults import DEFAULT_ANGLES, DEFAULT_PLANNER, TOLERANCE_DEG
from planner.errors import PlannerError, WorkpieceError
from planner.geometry.mesh import load_mesh
from planner.planning.planners import PLANNERS
from planner.planning.scan_planning import ScanPlans, plan_scan
from planner.plans.arm_motion import ArmMotion
from planner.plans.plan import Plan
from planner.plans.problem import Problem
from planner.plans.verification import verify
from protocol.files.whole_file import write_whole
from protocol.program.command_line import program_name
from protocol.program.progress import progress_line

# At a deviation of the table as large as allowed in a run, plus a margin, nothing forbidden may be touched.
_OFF_DEG = TOLERANCE_DEG + 0.05
# A pattern with a larger share of beams without a measurement is tried last.
_FEW_MISSES = 0.1


class Drafted(NamedTuple):
    """A scan that can be planned, and its plans."""

    draft: Draft
    plans: ScanPlans


def run(arguments: argparse.Namespace) -> int:
    """Write the scan file, print the assumptions, and return the exit status."""
    out: Path = arguments.out or Path(f"{arguments.mesh.stem}.toml")
    if out.exists():
        raise PlannerError(f"{out}: already exists; remove it, or choose another file with --out")
    mesh = load_mesh(arguments.mesh, arguments.unit, options.say, progress_line("mesh", sys.stderr))
    part = Part(mesh, arguments.mesh, arguments.unit or "mm", arguments.up)
    try:
        check_it_fits_the_table(mesh, part.cell)
        drafted = first_that_plans(part, arguments.kind, arguments.pattern, out.stem)
    except WorkpieceError as error:
        raise WorkpieceError(f"{arguments.mesh}: {error}") from error
    try:
        out.parent.mkdir(parents=True, exist_ok=True)
        write_whole(out, drafted.draft.text(out.parent))
    except OSError as error:
        raise PlannerError(f"{out}: cannot write the scan ({error.strerror or error})") from error
    sys.stdout.write(summary(drafted, out))
    return 0


def first_that_plans(part: Part, kind: str | None, pattern: str | None, name: str) -> Drafted:
    """Return the first scan of a part with a plan that the arm can follow, including a margin.

    Patterns that measure at nearly all of their locations are tried first.

    Raises:
        WorkpieceError: there is none.
    """
    reasons = []
    for draft in sorted(drafts(part, kind, pattern), key=lambda each: share_missed(each) > _FEW_MISSES):
        plans = plan_scan(
            draft.scan(name),
            "best",
            DEFAULT_ANGLES,
            PLANNERS[DEFAULT_PLANNER],
            lambda label: progress_line(label, sys.stderr),
            compiled=DEFAULT_PLANNER,
        )
        best = plans.best
        if best is not None and has_room(best.problem, best.plan, best.arm):
            return Drafted(draft, plans)
        reason = plans.comparison.refusal if best is None else "its plan touches what is forbidden"
        reasons.append(f"{draft.pattern}{_layout(draft)}: {reason}")
    tried = "; ".join(reasons) or "no pattern meets the part"
    raise WorkpieceError(
        f"no pattern can be scanned in the default cell ({tried}); choose a --pattern, rotate the part with --up,"
        " or write a path file, see docs/own-part.md"
    )


def share_missed(draft: Draft) -> float:
    """Return the share of locations without a measurement."""
    faults = beam_faults(draft.path().T_WS, draft.part.mesh, draft.part.cell.probe)
    return float(np.mean(faults.away | faults.misses | faults.beyond))


def has_room(problem: Problem, plan: Plan, arm: ArmMotion) -> bool:
    """Return whether the arm can follow, and whether small deviations of the table touch nothing forbidden."""
    beside = (replace(plan, angles_deg=plan.angles_deg + off_deg) for off_deg in (-_OFF_DEG, 0.0, _OFF_DEG))
    return arm.step is None and all(verify(problem, each).is_executable for each in beside)


def _layout(draft: Draft) -> str:
    return "".join(f", {name} {value:g}" for name, value in draft.keys)


def summary(drafted: Drafted, out: Path) -> str:
    """Return the written file, the assumptions, and the next step, as text."""
    draft, part = drafted.draft, drafted.draft.part
    assert drafted.plans.best is not None
    problem, plan = drafted.plans.best.problem, drafted.plans.best.plan
    x, y, z = (float(side) for side in part.mesh.extents)
    cell, placed = part.cell, part.placement
    warning = beam_warning(draft.path().T_WS, part.mesh, cell.probe)
    lines = [
        f"{out}: {part.kind.name}, {x:.1f} x {y:.1f} x {z:.1f} mm; pattern {draft.pattern}{_layout(draft)} on the class"
        f" {draft.kind}, {problem.map.location_count} locations, {problem.step_count * problem.step_s:g} s",
        f"assumed: lengths in {part.unit} (--unit)",
        f"         axis {part.up} of the file points up (--up)",
        "         the part is in the middle of the table: workpiece_on_table ="
        f" [{', '.join(f'{value:.10g}' for value in placed)}]",
        f"         arm {cell.arm.name} and the cell of the shipped scans (arm, table_in_base, probe_on_flange)",
        f"         stand-off {cell.probe.stand_off_mm:g} mm, measuring range {cell.probe.nearest_mm:g} to"
        f" {cell.probe.farthest_mm:g} mm, laser line {cell.probe.line_width_mm:g} mm",
        f"checked: a plan exists in {plan.configuration}",
    ]
    if warning is not None:
        lines.append(f"note:    {warning}")
    folder, planner = Path("build") / out.stem, program_name("planner")
    lines += [
        f"next:    {planner} plan {quote(str(out))} --out {quote(str(folder))}",
        f"         {planner} run {quote(str(folder / 'plan.json'))} --port emulator:// --arm-away"
        f" --out {quote(str(folder / 'run'))}",
    ]
    return "\n".join(lines) + "\n"
