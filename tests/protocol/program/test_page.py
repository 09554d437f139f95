"""A page: its content, that it is self-contained, and that no text in it is interpreted."""

from html.parser import HTMLParser

import pytest
from hypothesis import given
from hypothesis import strategies as st

from protocol.program.page import (
    Marked,
    Origin,
    counted,
    details,
    figure,
    heading,
    page,
    paragraph,
    table,
    verdict,
)

VOID = {"meta", "circle", "rect"}


class Read(HTMLParser):
    """A page as a browser reads it: its tags with their attributes, and all of its text."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.tags: list[tuple[str, dict[str, str | None]]] = []
        self.text = ""
        self.open: list[str] = []
        self.feed(text)
        self.close()

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append((tag, dict(attrs)))
        if tag not in VOID:
            self.open.append(tag)

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        self.text += data


@given(st.text(st.characters(exclude_categories=("Cs", "Cc")), min_size=1))
def test_any_text_is_shown_and_adds_no_tag(text: str) -> None:
    def written(word: str) -> Read:
        blocks = (
            verdict(word, is_good=False),
            heading(word),
            paragraph(word),
            table((word, ""), [(word, Marked(word, "bad"))]),
            figure("<svg viewBox='0 0 1 1'></svg>", word, word),
            details(word, paragraph(word)),
        )
        return Read(page(word, blocks, Origin(word, word)))

    shown = written(text)
    assert not shown.open
    assert [tag for tag, _ in shown.tags] == [tag for tag, _ in written("word").tags]
    assert next(attributes for tag, attributes in shown.tags if tag == "svg")["aria-label"] == text
    assert shown.text.count(text) >= 11


def test_a_page_fits_narrow_screens_dark_ones_and_paper_and_fetches_nothing() -> None:
    read = Read(page("Title", []))
    assert ("meta", {"name": "viewport", "content": "width=device-width, initial-scale=1"}) in read.tags
    assert "prefers-color-scheme: dark" in read.text
    assert "@media print" in read.text
    assert "http" not in read.text
    assert not [name for _, attributes in read.tags for name in attributes if name in ("src", "href")]


@pytest.mark.parametrize(
    ("origin", "foot"),
    [
        (Origin("python -m tools.tune --out 'a b'"), "python -m tools.tune --out 'a b'"),
        (Origin("conform", "2026-11-28T17:00:00+00:00"), "2026-11-28T17:00:00+00:00 · conform"),
        (None, ""),
    ],
)
def test_the_foot_names_version_date_and_command(origin: Origin | None, foot: str) -> None:
    last = Read(page("Title", [], origin)).text.rstrip().rpartition("seventh-axis ")[2]
    assert last.partition(" · ")[2] == foot


def test_a_wide_table_scrolls_by_itself_and_its_sums_stand_out() -> None:
    rows = table(("a", "b"), [("x", "1"), ("sum", Marked("1", "good"))], sums=1)
    assert rows.startswith('<div class="wide"><table>')
    assert '<tr class="sum"><td>sum</td><td class="good">1</td></tr>' in rows


@pytest.mark.parametrize(("number", "text"), [(0, "0 decimals"), (1, "1 decimal"), (1200, "1,200 decimals")])
def test_a_noun_is_counted_without_brackets(number: int, text: str) -> None:
    assert counted(number, "decimal") == text
