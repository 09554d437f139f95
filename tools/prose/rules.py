"""Words that docs and help texts do not use, and where a text has them."""

import re
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import NamedTuple

from protocol.data_file import read_toml

VOCABULARY = Path(__file__).with_name("vocabulary.toml")
_CODE = re.compile(
    r"^```(?s:.*?)^```|(?:^\n|\A)(?:^ {4,}[^\n]*\n)+|`[^`]*`|\[\S*\.md\]\([^)]*\)|\]\([^)]*\)", re.MULTILINE
)
"""What is not prose in Markdown: blocks and spans of code, and the targets of links."""


class Rule(NamedTuple):
    """A pattern, and what to write where it is found."""

    pattern: re.Pattern[str]
    instead: str


class Finding(NamedTuple):
    """A place where a text breaks a rule."""

    line: int
    words: str
    instead: str


def load_rules(file: Path = VOCABULARY) -> tuple[Rule, ...]:
    """Return the rules of a vocabulary.

    Raises:
        DataFileError: The file cannot be read.
    """
    sections: Mapping[str, Mapping[str, str]] = read_toml(file)
    return tuple(
        Rule(re.compile(rf"(?<![\w-])(?:{pattern})(?![\w-])", re.IGNORECASE), instead)
        for section in sections.values()
        for pattern, instead in section.items()
    )


def findings(text: str, rules: tuple[Rule, ...], *, markdown: bool) -> Iterator[Finding]:
    """Yield what a text breaks, line by line; a phrase may run over the end of a line."""
    prose = _CODE.sub(lambda match: re.sub(r"[^\n]", "\0", match[0]), text) if markdown else text
    found = [(match.start(), match[0], rule.instead) for rule in rules for match in _in_one_line(prose, rule)]
    for start, words, instead in sorted(found):
        yield Finding(text.count("\n", 0, start) + 1, words, instead)


def _in_one_line(prose: str, rule: Rule) -> Iterator[re.Match[str]]:
    return rule.pattern.finditer(prose.replace("\n", " "))
