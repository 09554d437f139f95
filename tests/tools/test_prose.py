"""The prose linter finds a forbidden word in a page and in a help text, and leaves code alone."""

import argparse
from pathlib import Path

import pytest

from tools.prose.__main__ import help_texts, main
from tools.prose.rules import findings, load_rules

RULES = load_rules()


@pytest.mark.parametrize(
    ("sentence", "words"),
    [
        ("Start the stand-in first.", "stand-in"),
        ("The table says where it is.", "says"),
        ("This is no number.", "is no"),
        ("It prints the\ngreatest speed.", "the greatest"),
        ("Hold it against tables of another make.", "tables of another make"),
        ("The value is foretold.", "foretold"),
    ],
)
def test_a_forbidden_word_is_found(sentence: str, words: str) -> None:
    assert [finding.words for finding in findings(sentence, RULES, markdown=True)] == [words]


@pytest.mark.parametrize(
    "text",
    [
        "The emulator is a stand-in for the real table.",
        "It is no longer there.",
        "Run `say hello`.",
        "```console\n$ say hello\n```\n",
        "Text:\n\n    say hello\n\nMore text.",
        "See [the emulator](stand-in.md) or [stand-in.md](stand-in.md).",
        "The sayings are essays.",
    ],
)
def test_plain_words_code_and_links_are_left_alone(text: str) -> None:
    assert not list(findings(text, RULES, markdown=True))


def test_a_finding_has_its_line_and_what_to_write() -> None:
    (finding,) = findings("One.\n\n```\nsays\n```\n\nThe port says so.\n", RULES, markdown=True)
    assert (finding.line, finding.words) == (7, "says")
    assert "states" in finding.instead


def test_a_forbidden_word_in_a_page_ends_the_linter_with_status_1(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    page = tmp_path / "page.md"
    page.write_text("Plain.\nThe planner minds the limits.\n", encoding="utf-8")
    assert main([str(page)]) == 1
    assert f"{page}:2: 'minds': write " in capsys.readouterr().out
    page.write_text("Plain.\n", encoding="utf-8")
    assert main([str(page)]) == 0


def test_a_forbidden_word_in_a_help_text_is_found() -> None:
    parser = argparse.ArgumentParser(description="Plain.")
    parser.add_argument("--decimals", help="places after the point")
    ((place, finding),) = help_texts("planner", parser)
    assert place == "help of planner: --decimals"
    assert finding.instead == "decimal places"


def test_docs_and_help_texts_are_clean(capsys: pytest.CaptureFixture[str]) -> None:
    assert main([]) == 0, capsys.readouterr().out
