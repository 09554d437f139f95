"""One self-contained HTML page for wide and narrow screens, light and dark mode, and print."""

from collections.abc import Iterable, Sequence
from html import escape
from importlib.resources import files
from typing import Literal, NamedTuple

from protocol.program.software_version import software_version

Kind = Literal["good", "bad"]


class Marked(NamedTuple):
    """A highlighted cell of a table."""

    text: str
    kind: Kind


Cell = str | Marked


class Origin(NamedTuple):
    """The origin of a page: the command line, and its date and time if the run had one."""

    command: str = ""
    date: str | None = None


def page(title: str, blocks: Iterable[str], origin: Origin | None = None, style: str = "") -> str:
    """Return a page from blocks of HTML; `style` is additional CSS of this page."""
    css = files("protocol.program").joinpath("page.css").read_text(encoding="utf-8") + style
    body = "\n".join((f"<h1>{escape(title)}</h1>", *blocks, _footer(origin or Origin())))
    return (
        '<!DOCTYPE html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        f"<title>{escape(title)}</title>\n<style>\n{css}</style>\n</head>\n<body>\n{body}\n</body>\n</html>\n"
    )


def counted(number: int, noun: str) -> str:
    """Return a number with its noun, such as `1 decimal` or `3 decimals`."""
    return f"{number:,} {noun}{'' if number == 1 else 's'}"


def heading(text: str) -> str:
    """Return the heading of a section."""
    return f"<h2>{escape(text)}</h2>"


def paragraph(text: str) -> str:
    """Return a paragraph of explanation."""
    return f'<p class="note">{escape(text)}</p>'


def verdict(text: str, is_good: bool) -> str:
    """Return the main result as a sentence with the worst figure."""
    return f'<p class="verdict {"good" if is_good else "bad"}">{escape(text)}</p>'


def table(head: Sequence[str], rows: Iterable[Sequence[Cell]], sums: int = 0, words: bool = False) -> str:
    """Return a table of figures, or of text; the last `sums` rows are highlighted as sums."""
    header = "<tr>" + "".join(f"<th>{escape(cell)}</th>" for cell in head) + "</tr>" if any(head) else ""
    lines = ["".join(map(_cell, row)) for row in rows]
    body = "\n".join(
        f'<tr class="sum">{line}</tr>' if number >= len(lines) - sums else f"<tr>{line}</tr>"
        for number, line in enumerate(lines)
    )
    return f'<div class="wide"><table{" class=words" if words else ""}>{header}{body}</table></div>'


def figure(svg: str, alt: str, caption: str = "") -> str:
    """Return an `<svg>` element as a figure; `alt` is its text alternative."""
    described = svg.replace("<svg ", f'<svg role="img" aria-label="{escape(alt)}" ', 1)
    below = f"<figcaption>{escape(caption)}</figcaption>" if caption else ""
    return f'<figure><div class="wide">{described}</div>{below}</figure>'


def details(summary: str, block: str) -> str:
    """Return a block that opens on a click on its summary."""
    return f"<details><summary>{escape(summary)}</summary>{block}</details>"


def _cell(cell: Cell) -> str:
    if isinstance(cell, Marked):
        return f'<td class="{cell.kind}">{escape(cell.text)}</td>'
    return f"<td>{escape(cell)}</td>"


def _footer(origin: Origin) -> str:
    parts = [f"seventh-axis {escape(software_version())}"]
    if origin.date is not None:
        parts.append(escape(origin.date))
    if origin.command:
        parts.append(f"<code>{escape(origin.command)}</code>")
    return f"<footer>{' &middot; '.join(parts)}</footer>"
