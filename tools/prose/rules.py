"""Words and long sentences that the project's prose does not use, and where a text has them."""

import re
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import NamedTuple

from protocol.files.data_file import read_toml
from tools.prose.python_texts import texts

VOCABULARY = Path(__file__).with_name("vocabulary.toml")
_CODE = re.compile(
    r"^```(?s:.*?)^```|(?:^\n|\A)(?:^ {4,}[^\n]*\n)+|`[^`]*`|\[\S*\.md\]\([^)]*\)|\]\([^)]*\)", re.MULTILINE
)
"""The part of Markdown that is not prose: blocks and spans of code, and the targets of links."""


MOST_WORDS = 25
"""Maximum number of words of a sentence."""

_WORD = re.compile(r"[A-Za-z][\w'/-]*")
_SENTENCE_END = re.compile(r"[.!?;:](?=\s|$)|\n\s*\n|\n(?=\s*(?:[-|]|python ))")
"""The end of a sentence or a paragraph, or the start of the next item of a list or command line."""


class Rule(NamedTuple):
    """A pattern, and what to write instead."""

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
        DataFileError: the file cannot be read.
    """
    sections: Mapping[str, Mapping[str, str]] = read_toml(file)
    return tuple(
        Rule(re.compile(rf"(?<![\w-])(?:{pattern})(?![\w-])", re.IGNORECASE), instead)
        for section in sections.values()
        for pattern, instead in section.items()
    )


def findings(text: str, rules: tuple[Rule, ...], *, markdown: bool) -> Iterator[Finding]:
    """Yield the findings in a text by line; a phrase may continue on the next line."""
    prose = _CODE.sub(lambda match: re.sub(r"[^\n]", "\0", match[0]), text) if markdown else text
    found = [(match.start(), match[0], rule.instead) for rule in rules for match in _in_one_line(prose, rule)]
    for start, words, instead in sorted(found):
        yield Finding(text.count("\n", 0, start) + 1, words, instead)


def python_findings(source: str, rules: tuple[Rule, ...], *, messages: bool = True) -> Iterator[Finding]:
    """Yield the findings in the docstrings, the comments and, if wanted, the messages of a Python file.

    Raises:
        SyntaxError: the source is not Python.
    """
    for line, text in texts(source, messages=messages):
        prose = f"{text}\n"
        for finding in (*findings(prose, rules, markdown=True), *long_sentences(prose)):
            yield finding._replace(line=line + finding.line - 1)


def long_sentences(text: str) -> Iterator[Finding]:
    """Yield the sentences of a text with more than `MOST_WORDS` words; a colon or a semicolon ends a sentence."""
    prose = _CODE.sub(lambda match: "code" + "\n" * match[0].count("\n"), text)
    start = 0
    for end in [*_SENTENCE_END.finditer(prose), None]:
        sentence = prose[start : end.start() if end else len(prose)]
        if len(words := _WORD.findall(sentence)) > MOST_WORDS:
            line = prose.count("\n", 0, start + len(sentence) - len(sentence.lstrip())) + 1
            yield Finding(line, f"{' '.join(words[:4])} ...", f"shorter sentences: this one has {len(words)} words")
        start = end.end() if end else start


def _in_one_line(prose: str, rule: Rule) -> Iterator[re.Match[str]]:
    return rule.pattern.finditer(prose.replace("\n", " "))
