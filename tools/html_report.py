"""A report as one HTML file that needs nothing else: text, tables, and figures as inline SVG."""

import io
from collections.abc import Iterable, Sequence
from contextlib import AbstractContextManager
from html import escape
from typing import Any

import matplotlib as mpl
from matplotlib.figure import Figure

BLUE, ORANGE, GREEN, RED, GREY = "#1f5fa8", "#d9822b", "#2e7d4f", "#b3362b", "#7a7f87"

_SETTINGS: Any = {
    "svg.hashsalt": "seventh-axis",  # the same figure gives the same bytes
    "svg.fonttype": "none",
    "font.family": "sans-serif",
    "font.size": 9.5,
    "axes.grid": True,
    "grid.color": "#e3e6ea",
    "axes.edgecolor": "#9aa0a8",
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.titlesize": 10.5,
    "axes.titleweight": "bold",
    "axes.titlelocation": "left",
    "legend.frameon": False,
    "lines.linewidth": 1.5,
}

_STYLE = """
body { font: 15px/1.5 system-ui, "Segoe UI", Helvetica, Arial, sans-serif; color: #23272d; background: #fff;
       max-width: 1080px; margin: 2.2em auto; padding: 0 1.4em; }
h1 { font-size: 1.7em; margin-bottom: .2em; }
h2 { font-size: 1.2em; margin-top: 2em; border-bottom: 1px solid #d5d9de; }
p { max-width: 52em; } .lead { font-size: 1.08em; }
table { border-collapse: collapse; margin: .8em 0; font-variant-numeric: tabular-nums; }
th, td { padding: .28em .9em .28em 0; text-align: right; border-bottom: 1px solid #e3e6ea; }
th:first-child, td:first-child { text-align: left; } th { color: #5a616a; font-weight: 600; vertical-align: bottom; }
.good { color: #2e7d4f; } .bad { color: #b3362b; font-weight: 600; } .quiet { color: #7a7f87; }
figure { margin: 1em 0; } figure svg { max-width: 100%; height: auto; } figcaption { color: #5a616a; font-size: .92em; }
pre { background: #f5f6f8; padding: .7em 1em; overflow-x: auto; }
"""


def report_style() -> AbstractContextManager[None]:
    """Return the report's style, to be entered while figures are drawn."""
    return mpl.rc_context(_SETTINGS)


def new_figure(width_in: float, height_in: float, rows: int = 1, columns: int = 1) -> Figure:
    """Return a figure in the report's style, with its axes; draw on `figure.axes`."""
    with report_style():
        figure = Figure(figsize=(width_in, height_in), layout="constrained")
        figure.subplots(rows, columns)
    return figure


def svg_of(figure: Figure) -> str:
    """Return a figure as an SVG element."""
    buffer = io.StringIO()
    with report_style():
        figure.savefig(buffer, format="svg", metadata={"Date": None})
    text = buffer.getvalue()
    return text[text.index("<svg") :]


def figure_block(svg: str, caption: str) -> str:
    """Return a figure with its caption."""
    return f"<figure>{svg}<figcaption>{escape(caption)}</figcaption></figure>"


def table_block(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """Return a table; a cell that begins with `+` is shown as good, with `!` as bad, without the sign."""
    lines = ["<tr>" + "".join(f"<th>{escape(cell)}</th>" for cell in head) + "</tr>"]
    lines += ["<tr>" + "".join(map(_cell, row)) + "</tr>" for row in rows]
    return "<table>" + "\n".join(lines) + "</table>"


def paragraph(text: str, kind: str = "") -> str:
    """Return a paragraph; `kind` is `lead`, `quiet`, `good`, `bad` or nothing."""
    return f'<p class="{kind}">{escape(text)}</p>'


def heading(text: str) -> str:
    """Return a section's heading."""
    return f"<h2>{escape(text)}</h2>"


def page(title: str, blocks: Iterable[str]) -> str:
    """Return the whole page."""
    body = "\n".join(blocks)
    return (
        f'<!DOCTYPE html>\n<html lang="en"><head><meta charset="utf-8"><title>{escape(title)}</title>'
        f"<style>{_STYLE}</style></head>\n<body><h1>{escape(title)}</h1>\n{body}\n</body></html>\n"
    )


def _cell(text: str) -> str:
    kind = {"+": "good", "!": "bad"}.get(text[:1])
    return f'<td class="{kind}">{escape(text[1:])}</td>' if kind else f"<td>{escape(text)}</td>"
