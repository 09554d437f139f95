"""One HTML page that needs nothing else: plain, readable, printable."""

import base64
import io
from collections.abc import Sequence
from html import escape

from matplotlib.figure import Figure

_STYLE = """
body { font: 15px/1.5 system-ui, "Segoe UI", Helvetica, Arial, sans-serif; color: #23272d; background: #fff;
       max-width: 1020px; margin: 2.2em auto; padding: 0 1.4em; }
h1 { font-size: 1.6em; margin-bottom: .3em; }
h2 { font-size: 1.15em; margin: 2em 0 .5em; border-bottom: 1px solid #d5d9de; }
table { border-collapse: collapse; margin: .6em 0; font-variant-numeric: tabular-nums; }
th, td { padding: .22em 1.3em .22em 0; text-align: right; border-bottom: 1px solid #e8eaee; vertical-align: top; }
th:first-child, td:first-child { text-align: left; } th { color: #5a616a; font-weight: 600; }
table.words td, table.words th { text-align: left; }
tr.sum td { border-top: 1.5px solid #23272d; font-weight: 600; }
.verdict { font-size: 1.15em; padding: .6em 1em; border-left: 5px solid; background: #f6f7f9; }
.good { border-color: #2e7d4f; } .bad { border-color: #b3362b; }
.note { color: #5a616a; max-width: 56em; }
figure { margin: .8em 0; } figure img, figure svg { width: 100%; height: auto; }
details { margin: .6em 0; } summary { cursor: pointer; color: #1f5fa8; }
"""


def page(title: str, blocks: Sequence[str]) -> str:
    """Return the page of some blocks of HTML."""
    body = "\n".join((f"<h1>{escape(title)}</h1>", *blocks))
    return (
        f'<!DOCTYPE html>\n<html lang="en"><head><meta charset="utf-8"><title>{escape(title)}</title>'
        f"<style>{_STYLE}</style></head>\n<body>\n{body}\n</body></html>\n"
    )


def heading(text: str) -> str:
    """Return the heading of a part."""
    return f"<h2>{escape(text)}</h2>"


def note(text: str) -> str:
    """Return a paragraph of explanation."""
    return f'<p class="note">{escape(text)}</p>'


def verdict(text: str, is_good: bool) -> str:
    """Return the sentence that matters most."""
    return f'<p class="verdict {"good" if is_good else "bad"}">{escape(text)}</p>'


def table(head: Sequence[str], rows: Sequence[Sequence[str]], sums: int = 0, words: bool = False) -> str:
    """Return a table of figures, or of words; the last `sums` rows stand out as sums."""
    header = "<tr>" + "".join(f"<th>{escape(cell)}</th>" for cell in head) + "</tr>" if any(head) else ""
    body = []
    for number, row in enumerate(rows):
        kind = ' class="sum"' if number >= len(rows) - sums else ""
        body.append(f"<tr{kind}>" + "".join(f"<td>{escape(cell)}</td>" for cell in row) + "</tr>")
    kind = ' class="words"' if words else ""
    return f"<table{kind}>{header}" + "\n".join(body) + "</table>"


def picture(figure: Figure, what: str) -> str:
    """Return a figure as a picture within the page; `what` it shows is said to those who cannot see it."""
    data = io.BytesIO()
    figure.savefig(data, format="png", dpi=130, metadata={"Software": None})
    encoded = base64.b64encode(data.getvalue()).decode("ascii")
    return f'<figure><img alt="{escape(what)}" src="data:image/png;base64,{encoded}"></figure>'


def drawing(figure: Figure) -> str:
    """Return a figure as lines and text that the reader can zoom into."""
    text = io.StringIO()
    figure.savefig(text, format="svg", metadata={"Date": None})
    return f"<figure>{text.getvalue()[text.getvalue().index('<svg') :]}</figure>"


def details(summary: str, block: str) -> str:
    """Return a block that opens when its summary is clicked."""
    return f"<details><summary>{escape(summary)}</summary>{block}</details>"
