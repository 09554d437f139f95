"""An adaptive scan as one HTML page, as part of `scan.json`, and in one sentence."""

from collections.abc import Iterator
from typing import Any

from planner.adaptive.adaptive_plots import coverage_steps_figure, strips_figure
from planner.adaptive.adaptive_scan import AdaptiveScanned
from planner.plot_style import svg_of
from planner.scanning.coverage import REASONS
from planner.scanning.scan_plots import STATE_NAMES
from planner.scanning.scan_report import scan_blocks
from protocol.program.page import Cell, Marked, Origin, counted, figure, heading, page, paragraph, table, verdict

# Regions that get a row of their own.
_REGIONS = 10
_MM2 = 100.0
"""In a square centimeter."""


def adaptive_verdict(scanned: AdaptiveScanned) -> str:
    """Return what an adaptive scan came to in one sentence or two."""
    text = (
        f"{_of_visible(scanned)}{scanned.share_of_whole:.1%} of the whole surface, with"
        f" {counted(len(scanned.strips), 'strip')}{' after the path' if scanned.path is not None else ''};"
        f" the session takes {scanned.duration_s:.0f} s."
    )
    failed = [n for n, strip in enumerate(scanned.strips, 1) if not strip.verification.is_verified]
    if scanned.session.failure is not None:
        text += f" It ended early: {scanned.session.failure}."
    elif not scanned.has_wanted_share:
        text += f" Wanted were {scanned.adapt.share:.1%}: {_why_less(scanned)}."
    if not scanned.knows_visible:
        text += " What can be seen was not computed."
    if failed:
        text += f" Strip {failed[0]} {scanned.strips[failed[0] - 1].verification.verdict}."
    return text


def _of_visible(scanned: AdaptiveScanned) -> str:
    return f"{scanned.share_of_visible:.1%} of what can be seen, " if scanned.knows_visible else ""


def _why_less(scanned: AdaptiveScanned) -> str:
    if len(scanned.strips) >= scanned.adapt.most_strips:
        return "all strips that were allowed are scanned (--most-strips)"
    refused = sum(step.refusal is not None for step in scanned.session.steps)
    if refused:
        return f"{counted(refused, 'strip')} could not be carried out, and no others see what is left"
    return "no other strip was found that sees more"


def adaptive_report(scanned: AdaptiveScanned, origin: Origin | None = None) -> str:
    """Return the page of an adaptive scan."""
    blocks = (
        verdict(adaptive_verdict(scanned), scanned.has_succeeded),
        heading("Strips"),
        figure(
            svg_of(strips_figure(scanned)),
            "The strips on the part, from four sides: which strip saw a place first, and where its middle runs"
            " (a dot at its beginning, its number at its end).",
        ),
        figure(
            svg_of(coverage_steps_figure(scanned)),
            f"Coverage strip by strip: {_of_visible(scanned)}{scanned.share_of_whole:.1%} of the whole in the end.",
        ),
        table(
            ("strip", "of what can be seen", "of the whole", "table (deg)", "way (s)", "motion (s)", "off its plan"),
            list(_strips(scanned)),
        ),
        paragraph(
            "On the way to a strip, the probe retracts along its beam, the arm moves, and the probe approaches."
            " The table turns while the arm moves, or while it waits clear of the part. Joint limits, joint speeds and"
            " collisions are checked everywhere along it. The arm is taken to use half of its joint speeds."
        ),
        *_refused(scanned),
        heading("What stays unseen"),
        paragraph(
            "What can be seen is what was seen, and what any candidate strip that the arm can reach would see. The rest"
            " faces the table, lies too deep, or is out of the arm's reach as the part stands."
            if scanned.knows_visible
            else "The session ended before it was computed what of this some strip would see."
        ),
        table(
            ("region", "area (cm²)", "of it some strip would see (cm²)", "middle x, y, z (mm)", "why"),
            list(_regions(scanned)),
            words=True,
        ),
        *scan_blocks(scanned.scanned),
    )  # fmt: skip
    return page(f"Adaptive scan of {scanned.scanned.scan.name}", blocks, origin)


def _strips(scanned: AdaptiveScanned) -> Iterator[tuple[Cell, ...]]:
    visible = max(1, int(scanned.visible.sum()))
    shares = [
        (f"{seen / visible:.1%}" if scanned.knows_visible else "", f"{seen / scanned.places:.1%}")
        for seen in scanned.seen_after
    ]
    if scanned.path is not None:
        motion = scanned.path.motion()
        way = f"{motion.start_deg:.0f} to {scanned.path.plan.angles_deg[-1]:.0f}"
        yield (
            "path",
            *shares.pop(0),
            way,
            "",
            f"{motion.end_s - motion.start_s:.1f}",
            scanned.path.plan.configuration,
            "",
        )
    for number, (strip, share) in enumerate(zip(scanned.strips, shares, strict=True), 1):
        plan = strip.plan.plan
        result = strip.verification
        held = f"{result.worst_deg:.3f} deg" if result.is_verified else Marked(result.verdict, "bad")
        yield (
            str(number), *share, f"{plan.angles_deg[0]:.0f} to {plan.angles_deg[-1]:.0f}",
            f"{strip.transfer.duration_s:.1f}", f"{strip.duration_s - strip.transfer.duration_s:.1f}",
            held,
        )  # fmt: skip


def _refused(scanned: AdaptiveScanned) -> Iterator[str]:
    refused = [step for step in scanned.session.steps if step.refusal is not None]
    if refused:
        yield heading("Strips that could not be carried out")
        yield table(("strip", "why"), [(step.strip.name, str(step.refusal)) for step in refused], words=True)


def _regions(scanned: AdaptiveScanned) -> Iterator[tuple[Cell, ...]]:
    for number, region in enumerate(scanned.regions[:_REGIONS], 1):
        middle = ", ".join(f"{value:.0f}" for value in region.center_W)
        yield (
            str(number), f"{region.area_mm2 / _MM2:.2f}", _can_be_seen(scanned, region.can_be_seen_mm2), middle,
            REASONS[region.reason],
        )  # fmt: skip
    rest = scanned.regions[_REGIONS:]
    if rest:
        area_mm2, visible_mm2 = (
            sum(each) for each in zip(*((r.area_mm2, r.can_be_seen_mm2) for r in rest), strict=True)
        )
        yield f"{len(rest)} smaller ones", f"{area_mm2 / _MM2:.2f}", _can_be_seen(scanned, visible_mm2), "", ""


def _can_be_seen(scanned: AdaptiveScanned, area_mm2: float) -> str:
    return f"{area_mm2 / _MM2:.2f}" if scanned.knows_visible else ""


def adaptive_document(scanned: AdaptiveScanned) -> dict[str, Any]:
    """Return the strips as part of `scan.json`; lengths in mm, areas in mm2, angles in deg, times in s."""
    return {
        "wanted": scanned.adapt.share,
        "seen_of_visible": scanned.share_of_visible if scanned.knows_visible else None,
        "seen_of_whole": scanned.share_of_whole,
        "visible_of_whole": float(scanned.visible.mean()) if scanned.knows_visible else None,
        "duration_s": scanned.duration_s,
        "path": scanned.path is not None,
        "strips": [
            {
                "T_WS": strip.plan.strip.T_WS.tolist(),
                "step_s": strip.plan.plan.step_s,
                "configuration": strip.plan.plan.configuration,
                "table_deg": strip.plan.plan.angles_deg.tolist(),
                "transfer": {
                    "joints_deg": scanned.scanned.scan.cell.arm.robot_deg(strip.transfer.joints).tolist(),
                    "moves_s": strip.transfer.moves_s.tolist(),
                    "table_s": strip.transfer.table_s,
                    "table_turns_with_arm": strip.transfer.is_direct,
                },
                "verdict": strip.verification.verdict,
            }
            for strip in scanned.strips
        ],
        "seen_after": [seen / scanned.places for seen in scanned.seen_after],
        "refused": [step.refusal for step in scanned.session.steps if step.refusal is not None],
        "unseen": [
            {
                "area_mm2": region.area_mm2,
                "can_be_seen_mm2": region.can_be_seen_mm2 if scanned.knows_visible else None,
                "center_W": region.center_W.tolist(),
                "reason": region.reason.name.lower(),
            }
            for region in scanned.regions
        ],
    }


def adaptive_summary(scanned: AdaptiveScanned) -> str:
    """Return what an adaptive scan came to, for people: a line on the strips, and what stays unseen and why."""
    unseen: dict[str, float] = {}
    for region in scanned.regions:
        name = STATE_NAMES[region.reason]
        unseen[name] = unseen.get(name, 0.0) + region.area_mm2 / _MM2
    parts = [f"{name} {area:.1f} cm²" for name, area in sorted(unseen.items(), key=lambda item: -item[1])]
    return f"strips     {adaptive_verdict(scanned)}\nunseen     {', '.join(parts) or 'nothing'}\n"
