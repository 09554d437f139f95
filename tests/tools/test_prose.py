"""The prose linter finds a forbidden word in a page, a help text and Python source, and ignores code."""

import argparse
from pathlib import Path

import pytest

from tools.prose.__main__ import help_texts, main
from tools.prose.python_texts import texts
from tools.prose.rules import findings, load_rules, long_sentences, python_findings

RULES = load_rules()


@pytest.mark.parametrize(
    ("sentence", "words"),
    [
        ("Start the stand-in first.", "stand-in"),
        ("The table says where it is.", "says"),
        ("This is no number.", "is no"),
        ("It prints the\ngreatest speed.", "the greatest"),
        ("Test tables of another make.", "tables of another make"),
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


SOURCE = '''"""The table says where it is."""

LIMIT = 3  # noqa: ANN401  # struck anew
"""The time-out."""


def run(number: int) -> None:
    """Run it.

    Args:
        say: the number.
        number: the number,
            once and for all.
    """
    # The table
    # hears it, `says` so.
    print("# no comment: it was told", "says")
    raise ValueError(f"the port {number} was not told what to do")
'''


def test_forbidden_words_are_found_in_docstrings_comments_and_messages_of_python_source() -> None:
    found = {(finding.line, finding.words) for finding in python_findings(SOURCE, RULES)}
    assert found == {
        (1, "says"),
        (3, "struck"),
        (3, "anew"),
        (4, "time-out"),
        (16, "hears"),
        (17, "told"),
        (18, "told"),
    }


def test_the_strings_of_a_test_are_data() -> None:
    lines = {finding.line for finding in python_findings(SOURCE, RULES, messages=False)}
    assert lines == {1, 3, 4, 16}


def test_texts_of_source_have_their_lines_and_no_directives() -> None:
    assert sorted(texts("# one\n# two\nx = 1  # noqa: E501\ny = 2  # three\n")) == [
        (1, "one\ntwo"),
        (3, ""),
        (4, "three"),
    ]


def words(count: int) -> str:
    return " ".join(["word"] * count)


@pytest.mark.parametrize(
    ("text", "starts"),
    [
        (words(26), [1]),
        (words(25), []),
        (f"{words(25)}. {words(25)}", []),
        (f"{words(25)}:\n{words(26)}", [2]),
        (f"{words(20)}\n\n{words(20)}", []),
        (f"{words(20)}\n- {words(20)}", []),
        (f"`{words(30)}`", []),
        (f"Text.\n\n{words(10)}\n{words(16)}\n", [3]),
        (f"Examples:\n\n    {words(40)}\n", []),
    ],
)
def test_a_sentence_of_more_than_25_words_is_found_at_its_start(text: str, starts: list[int]) -> None:
    assert [finding.line for finding in long_sentences(text)] == starts


def test_entries_of_a_docstring_are_sentences_of_their_own() -> None:
    entries = "\n".join(f"        name_{index}: {words(10)}" for index in range(4))
    source = f'def run():\n    """Run it.\n\n    Args:\n{entries}\n    """\n'
    assert not list(python_findings(source, RULES))


def test_a_forbidden_word_in_a_source_file_ends_the_linter_with_status_1(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    module = tmp_path / "module.py"
    module.write_text(SOURCE, encoding="utf-8")
    assert main([str(module)]) == 1
    assert f"{module}:16: 'hears': write " in capsys.readouterr().out


def test_all_prose_of_the_project_is_clean(capsys: pytest.CaptureFixture[str]) -> None:
    assert main([]) == 0, capsys.readouterr().out
