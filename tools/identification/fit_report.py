"""What an identification found: as text, as a configuration file, and as a report with the fit shown."""

import numpy as np
from matplotlib.figure import Figure

from emulator.config import TableConfig
from tools.emulated import Array
from tools.html_report import BLUE, ORANGE, figure_block, heading, new_figure, page, paragraph, svg_of, table_block
from tools.identification.identify_table import Constant, Identified
from tools.identification.parameters import PARAMETERS


def verdict(constant: Constant) -> str:
    """Return a constant with its interval in one line."""
    line = f"{constant.name}: {constant.value:.4g} ({constant.low:.4g} .. {constant.high:.4g}) {constant.unit}"
    return line if constant.told else f"{line}  [not told by this recording: mostly what was assumed]"


def table_toml(found: Identified) -> str:
    """Return the constants that were estimated, as a file for `--config`."""
    lines = ["# Identified from a recording. Torques and inertias hold for the motor resistance that was assumed."]
    lines += [f"# {verdict(constant)}" for constant in found.constants]
    for section in dict.fromkeys(parameter.section for parameter in PARAMETERS):
        lines += ["", f"[{section}]"]
        lines += [f"{each.key} = {each.value(found.config):.6g}" for each in PARAMETERS if each.section == section]
    return "\n".join(lines) + "\n"


def fit_report(found: Identified, assumed: TableConfig, source: str) -> str:
    """Return the report as HTML."""
    rows = [
        (
            f"{constant.name}, {constant.unit}",
            f"{constant.value:.4g}",
            f"{constant.low:.4g} .. {constant.high:.4g}",
            "+told" if constant.told else "!not told",
        )
        for constant in found.constants
    ]
    untold = [constant.name for constant in found.constants if not constant.told]
    return page(
        "Identified table",
        [
            paragraph(f"From {source}: {len(found.time_s)} readings over {found.time_s[-1]:.1f} s.", "lead"),
            paragraph(
                f"The recording does not tell: {', '.join(untold)}. Their values are mostly what was assumed."
                if untold
                else "The recording tells every constant.",
                "bad" if untold else "good",
            ),
            heading("Constants, with 95 % confidence intervals"),
            table_block(("constant", "estimate", "interval", ""), rows),
            paragraph(
                "The intervals hold for the model's structure and for what was assumed: motion alone cannot tell "
                f"the motor's resistance, so torques and inertias hold for the assumed "
                f"{assumed.motor.resistance_ohm:g} ohm.",
                "quiet",
            ),
            heading("The fit"),
            figure_block(svg_of(_fit_figure(found)), "Recorded and foretold, and what is left between them."),
        ],
    )


def _fit_figure(found: Identified) -> Figure:
    figure = new_figure(10.5, 5.2, rows=2)
    top, bottom = figure.axes
    time_s, seen_deg, foretold_deg = found.time_s, found.seen_deg, found.foretold_deg
    top.plot(time_s, seen_deg, color=ORANGE, linewidth=2.4, label="recorded")
    top.plot(time_s, foretold_deg, color=BLUE, linewidth=1.0, label="foretold")
    top.set_title("Compared")
    top.set_ylabel("deg")
    top.legend(loc="upper right")
    rest: Array = seen_deg - foretold_deg
    bottom.plot(time_s, rest, ".", markersize=1.6, color=BLUE)
    bottom.set_title(f"Recorded less foretold: rms {float(np.sqrt(np.mean(rest**2))):.4f} deg (rounding included)")
    bottom.set_ylabel("deg")
    bottom.set_xlabel("time, s")
    return figure
