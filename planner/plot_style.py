"""The common style of all plots: colors for color-blind readers, lines, fonts, sizes, files.

The colors are those of Okabe and Ito. Curves that may overlap have different line styles too. Axes are labeled
`quantity (unit)`. The same figure gives the same bytes.
"""

import io
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import matplotlib as mpl
from matplotlib.figure import Figure

from protocol.files.whole_file import whole_file

BLUE, VERMILION, GREEN, AMBER, SKY = "#0072b2", "#d55e00", "#009e73", "#e69f00", "#56b4e9"
INK, GRAY, PALE = "#23272d", "#7a7f87", "#c9ced4"
DPI = 130
WIDTH_IN = 9.6

PLANNED: dict[str, Any] = {"color": "#f4a26a", "linewidth": 5.5}
"""A planned value: a wide, pale line."""
EXECUTED: dict[str, Any] = {"color": BLUE, "linewidth": 1.3}
"""An actual value: a narrow, dark line over it."""
LIMIT: dict[str, Any] = {"color": GRAY, "linewidth": 0.8, "linestyle": "--"}
"""A limit of a plotted value."""

_SETTINGS: dict[Any, Any] = {
    "svg.hashsalt": "seventh-axis",
    "svg.fonttype": "none",
    "font.family": "sans-serif",
    "font.size": 9.5,
    "text.color": INK,
    "axes.labelcolor": INK,
    "axes.edgecolor": GRAY,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.titlesize": 10.5,
    "axes.grid": True,
    "axes.axisbelow": True,
    "grid.color": "#e3e6ea",
    "grid.linewidth": 0.7,
    "xtick.color": INK,
    "ytick.color": INK,
    "legend.frameon": False,
    "lines.linewidth": 1.4,
    "figure.dpi": DPI,
    "savefig.dpi": "figure",
    "image.interpolation": "nearest",
}


@contextmanager
def styled() -> Iterator[None]:
    """Draw in this style; also a decorator of functions that make figures."""
    with mpl.rc_context(_SETTINGS):
        yield


@styled()
def new_figure(height_in: float, width_in: float = WIDTH_IN) -> Figure:
    """Return an empty figure with automatic layout."""
    return Figure(figsize=(width_in, height_in), layout="constrained")


@styled()
def save_picture(figure: Figure, file: Path) -> None:
    """Write a figure in the format of the file's suffix; the file appears when it is complete."""
    ending = file.suffix.lower()
    undated = {".png": {"Software": None}, ".svg": {"Date": None}, ".pdf": {"CreationDate": None}}.get(ending)
    with whole_file(file) as partial:
        figure.savefig(partial, metadata=undated)


@styled()
def svg_of(figure: Figure) -> str:
    """Return a figure as an `<svg>` element."""
    text = io.StringIO()
    figure.savefig(text, format="svg", metadata=dict.fromkeys(("Creator", "Date", "Format", "Type")))
    return text.getvalue()[text.getvalue().index("<svg") :]
