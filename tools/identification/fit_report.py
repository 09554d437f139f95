"""The results of an identification: as text, as a configuration file, and as a report with the fit."""

import numpy as np
from matplotlib.figure import Figure

from emulator.config.table_config import TableConfig
from planner.plot_style import BLUE, EXECUTED, PLANNED, new_figure, styled, svg_of
from protocol.program.page import Marked, Origin, counted, figure, heading, page, paragraph, table
from protocol.program.page import verdict as headline
from tools.config_file import config_toml
from tools.identification.constants import Constant
from tools.identification.fit_checks import MOST_UNEXPLAINED_DEG, halves_of, unexplained_rms_deg
from tools.identification.identify_table import Identified
from tools.identification.parameters import PARAMETERS

_GAP_S = 0.5
"""Readings farther apart are not connected by a line."""


def verdict(constant: Constant) -> str:
    """Return a constant with its interval in one line."""
    line = f"{constant.name}: {constant.value:.4g} ({constant.low:.4g} .. {constant.high:.4g}) {constant.unit}"
    return (
        line if constant.identifiable else f"{line}  [not identifiable from this recording: mostly the assumed value]"
    )


def table_toml(found: Identified, warning: str = "") -> str:
    """Return the identified table, with its known constants, as a file for `--config`."""
    lines = [f"Warning: {warning}"] if warning else []
    lines += ["Identified from a recording. Torques and inertias are valid for the assumed motor resistance."]
    lines += [verdict(constant) for constant in found.constants]
    estimated = frozenset(f"{parameter.section}.{parameter.key}" for parameter in PARAMETERS)
    return config_toml(found.config, "\n".join(lines), always=estimated)


def fit_report(
    found: Identified, assumed: TableConfig, source: str, warning: str = "", origin: Origin | None = None
) -> str:
    """Return the report as HTML."""
    rows = [
        (
            f"{constant.name} ({constant.unit})",
            f"{constant.value:.4g}",
            f"{constant.low:.4g} .. {constant.high:.4g}",
            Marked("identifiable", "good") if constant.identifiable else "not identifiable",
        )
        for constant in found.constants
    ]
    missing = [constant.name for constant in found.constants if not constant.identifiable]
    return page(
        "Identified table",
        [
            headline(_believed(found), is_good=True),
            paragraph(f"From {source}: {counted(len(found.time_s), 'reading')} used, over {found.time_s[-1]:.1f} s."),
            paragraph(
                f"Not identifiable from this recording: {', '.join(missing)}. Their values are mostly the assumed ones."
                if missing
                else "Every constant is identifiable."
            ),
            *([paragraph(f"Warning: {warning}.")] if warning else []),
            heading("Constants, with 95 % confidence intervals"),
            table(("constant", "estimate", "interval", ""), rows),
            paragraph(
                "The intervals are valid for the structure of the model and its assumptions. Motion alone does not "
                f"identify the motor's resistance, so torques and inertias are valid for the assumed "
                f"{assumed.motor.resistance_ohm:g} ohm."
            ),
            heading("The halves of the recording"),
            table(
                ("constant", "first half", "second half", "difference (standard deviations)", "allowed"),
                [
                    (
                        f"{half.name} ({half.unit})",
                        f"{half.first:.4g}",
                        f"{half.second:.4g}",
                        f"{half.apart:.2f}",
                        f"{half.allowed:g}",
                    )
                    for half in halves_of(found)
                ],
            ),
            heading("The fit"),
            figure(
                svg_of(_fit_figure(found)),
                "Recorded and predicted angle of the table over time; below it the unexplained part.",
                "Recorded and predicted angles, and the distance of the predicted angles from the readings' intervals.",
            ),
        ],
        origin,
    )


def _believed(found: Identified) -> str:
    """Return why the fit is plausible; an implausible fit has no report."""
    rms_deg, count_deg = unexplained_rms_deg(found), 360.0 / found.config.counts_per_turn
    most = max(halves_of(found), key=lambda half: half.apart / half.allowed)
    return (
        f"The model explains the recording: beyond rounding {rms_deg / count_deg:.2g} counts rms are left, of "
        f"{MOST_UNEXPLAINED_DEG / count_deg:.2g} allowed. Both halves give the same constants: "
        f"the largest difference is {most.apart:.1f} standard deviations ({most.name}), of {most.allowed:g} allowed."
    )


@styled()
def _fit_figure(found: Identified) -> Figure:
    drawing = new_figure(5.2)
    top, bottom = drawing.subplots(2, 1, sharex=True)
    time_s, seen_deg, predicted_deg = found.time_s, found.seen_deg, found.predicted_deg
    after_gap = np.diff(time_s, prepend=time_s[0]) > _GAP_S
    seen_deg, predicted_deg = (np.where(after_gap, np.nan, angle_deg) for angle_deg in (seen_deg, predicted_deg))
    top.plot(time_s, seen_deg, **PLANNED, label="recorded")
    top.plot(time_s, predicted_deg, **EXECUTED, label="predicted")
    top.set_title("Table angle")
    top.set_ylabel("angle (deg)")
    top.legend(loc="upper right")
    left = found.unexplained_deg * found.config.counts_per_deg
    bottom.plot(time_s, left, ".", markersize=2.5, color=BLUE)
    rms = float(np.sqrt(np.mean(left**2)))
    bottom.set_title(
        f"Not explained by rounding: {np.count_nonzero(left)} of {len(left)} readings, rms {rms:.2g} counts"
    )
    bottom.set_ylabel("residual (counts)")
    bottom.set_xlabel("time (s)")
    return drawing
