"""The HTML page of a scan: verdict, cloud, error budget, coverage, and missing data."""

from collections import Counter
from collections.abc import Iterator

from planner.plot_style import svg_of
from planner.scanning.calibration import AxisCalibration
from planner.scanning.coverage import REASONS
from planner.scanning.deviation_plots import deviation_figure
from planner.scanning.error_budget import Contribution, ErrorBudget
from planner.scanning.measuring import COVERED_MM
from planner.scanning.probe import Sight
from planner.scanning.probe_calibration import ProbeCalibration
from planner.scanning.scan_plots import STATE_NAMES, budget_figure, coverage_figure
from planner.scanning.scan_run import Scanned
from protocol.program.page import Origin, counted, figure, heading, page, paragraph, table, verdict

_MICROMETERS = 1e3


def scan_report(scanned: Scanned, origin: Origin | None = None) -> str:
    """Return the page of a scan."""
    blocks = (
        verdict(verdict_of(scanned), scanned.is_whole),
        table(("", ""), list(_summary(scanned)), words=True),
        *scan_blocks(scanned),
    )
    return page(f"Scan of {scanned.scan.name}", blocks, origin)


def scan_blocks(scanned: Scanned) -> tuple[str, ...]:
    """Return the parts of the page on the cloud, its errors, coverage, calibration and profiles."""
    mesh, budget = scanned.scan.mesh, scanned.budget
    return (
        heading("The cloud"),
        paragraph("The color shows the distance of the cloud from the surface, averaged locally; gray: not measured."),
        figure(
            svg_of(deviation_figure(mesh, budget)),
            f"Deviation of the cloud from the surface; {_um(budget.distances.greatest)} µm at most at one point.",
        ),
        table(("", "mean (µm)", "sigma (µm)", "95 % within (µm)", "maximum (µm)"), [_distances(budget)]),
        heading("Sources of the error"),
        paragraph(_explanation(scanned)),
        figure(svg_of(budget_figure(budget)), "Contribution of each error source; distribution of distances."),
        _budget_table(budget),
        paragraph(_rounding(scanned)),
        heading("Coverage"),
        paragraph(
            f"A place counts as seen if a profile passes within {0.5 * COVERED_MM:g} mm and can measure it there."
            " All of the surface counts, the underside too."
        ),
        figure(
            svg_of(coverage_figure(mesh, scanned.coverage)),
            f"The part from two sides: {scanned.coverage.shares()[Sight.SEEN]:.1%} of its surface seen.",
        ),
        table(("of the surface", "share", "which means"), list(_coverage(scanned)), words=True),
        heading("Calibration"),
        _calibration(scanned),
        heading("Profiles"),
        table(("", ""), list(_profiles(scanned))),
    )


def verdict_of(scanned: Scanned) -> str:
    """Return the result of a scan in one sentence."""
    budget, seen = scanned.budget, scanned.coverage.shares()[Sight.SEEN]
    ended = ""
    if scanned.run.failure is not None:
        ended = f" It ended early: {scanned.run.failure}."
    elif scanned.is_interrupted:
        ended = " It was interrupted."
    distances, moved = budget.distances, budget.total.displacement_mm
    return (
        f"{scanned.points:,} points from {counted(len(scanned.run.numbers), 'profile')}: {_um(distances.sigma)} µm"
        f" (1 sigma) from the surface, {_um(distances.greatest)} µm at most, {_um(moved)} µm (rms) from their true"
        f" position; {seen:.1%} of the surface seen.{ended}"
    )


def _um(length_mm: float, decimals: int = 1) -> str:
    return f"{_MICROMETERS * length_mm:.{decimals}f}"


def _summary(scanned: Scanned) -> Iterator[tuple[str, str]]:
    plan, options = scanned.planned.plan, scanned.options
    yield "planned by", f"{plan.planner}, {plan.configuration}"
    yield "locations", f"{len(plan.angles_deg)}, one every {plan.step_s:g} s, {counted(len(plan.pauses), 'pause')}"
    yield "port", f"{options.port}, {options.baud} baud, {counted(options.decimals, 'decimal')}"
    yield "probe", f"{options.triggers.rate_hz:g} profiles a second, {scanned.probe.points_per_line} points each"
    yield "workpiece", f"{len(scanned.scan.mesh.faces):,} triangles"
    yield "seed", f"{options.seed}"
    yield "if the line had failed", f"{scanned.dead_line}"


def _distances(budget: ErrorBudget) -> tuple[str, ...]:
    name = f"cloud to mesh, {budget.samples:,} points"
    return (name, *(_um(value) for value in budget.distances))


def _explanation(scanned: Scanned) -> str:
    text = (
        "The same profiles, aligned again with one contribution only, and with all but one. Displacement is the"
        " distance of a point from its true position on the part. Its perpendicular component is visible as a distance"
        " from the mesh. A surface may be round around the table's axis, or perpendicular to it. Then a wrong angle"
        " moves its points along the surface, and the distance does not show this. Contributions may depend on one"
        " another, such as a constant backlash and the rounding of the same angle. Then the sum of the squares differs"
        " from the total."
    )
    if not scanned.run.tells_truth:
        text += " This port does not provide the true angle of the table, so the table's own contributions are missing."
    return text


def _budget_table(budget: ErrorBudget) -> str:
    def row(name: str, part: Contribution) -> tuple[str, ...]:
        return name, *(_um(value, 2) for value in part)

    rows = [row(str(name), part) for name, part in budget.parts.items()]
    rows += [
        ("all together", _um(budget.total.displacement_mm, 2), _um(budget.total.across_mm, 2), ""),
        ("root of the sum of squares", _um(budget.sum_mm, 2), "", ""),
        ("all switched off", f"{_MICROMETERS * budget.none_mm:.1g}", "", ""),
    ]
    return table(("rms", "displacement alone (µm)", "perpendicular (µm)", "left without it (µm)"), rows, 3)


def _rounding(scanned: Scanned) -> str:
    budget, decimals = scanned.budget, scanned.options.decimals
    return (
        f"Rounding in closed form: an angle error within one step of {10.0**-decimals:g} deg has"
        f" sigma {10.0**-decimals:g}/sqrt(12) deg. At the points' radius of {budget.radius_mm:.1f} mm (rms)"
        f" this is {_um(budget.rounding_mm, 2)} µm."
    )


def _coverage(scanned: Scanned) -> Iterator[tuple[str, str, str]]:
    shares = scanned.coverage.shares()
    for code in sorted(Sight, reverse=True):
        _, _, meaning = REASONS.get(code, "").partition(": ")
        yield STATE_NAMES[code], f"{shares[code]:.1%}", meaning


def _calibration(scanned: Scanned) -> str:
    axis, probe = scanned.knowledge.axis, scanned.knowledge.probe
    if axis is None or probe is None:
        return paragraph("The placements of the scan file were assumed to be exact.")
    wrong = f"{probe.wrong_starts} of {probe.starts} starts ended in a false minimum"
    radius = f"the sphere's radius fits as {probe.fitted_radius_mm:.4f} ± {probe.radius_uncertainty_mm:.4f} mm"
    head = ("", "from", "residual, rms (µm)", "position, sigma (µm)", "angle, sigma (mdeg)", "moves a point by (µm)")
    rows = [
        ("table axis", f"{len(axis.residuals_mm)} sphere centers", *_uncertainty(axis)),
        ("probe on the flange", f"{len(probe.residuals_mm):,} points", *_uncertainty(probe)),
    ]
    note = f"Probe: the residual is {probe.noise_ratio:.2f} times the noise; {radius}; {wrong}."
    return table(head, rows) + paragraph(note)


def _uncertainty(found: AxisCalibration | ProbeCalibration) -> tuple[str, ...]:
    sigmas = _um(found.uncertainty_mm), f"{1e3 * found.uncertainty_deg:.1f}"
    return _um(found.rms_mm), *sigmas, _um(found.point_error_mm)


def _profiles(scanned: Scanned) -> Iterator[tuple[str, str]]:
    run = scanned.run
    yield "taken along the path", f"{run.triggers:,}"
    yield "with a robot pose and a table angle", f"{len(run.numbers):,}"
    for reason, number in Counter(drop.value for drop in run.dropped.values()).items():
        yield f"dropped: {reason}", f"{number:,}"
