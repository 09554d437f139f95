"""The prose in Python source: docstrings, comments and messages, each with its first line."""

import ast
import inspect
import re
from collections.abc import Iterable, Iterator
from typing import NamedTuple

FEWEST_WORDS = 4
"""A string literal with fewer words is a name, a key or a format, and not a message."""

_WORD = re.compile(r"[A-Za-z]{2,}")
_COMMENT = re.compile(r"(?:^\s*|  )(#(?: .*)?)$")
_DIRECTIVE = re.compile(r"#\s*(?:noqa|type|ruff|fmt|isort|pragma)\b[^#]*")
_ENTRY = re.compile(r"^ {4}\w+:(?= )", re.MULTILINE)
"""The name of an argument or an exception in a section of a docstring; read as the dash of a list."""
_DOCUMENTED = ast.Module | ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef


class Text(NamedTuple):
    """A piece of prose, and the line on which it starts."""

    line: int
    text: str


def texts(source: str, *, messages: bool = True) -> list[Text]:
    """Return the docstrings, the comments and, if wanted, the messages of a Python file, in no order.

    Raises:
        SyntaxError: the source is not Python.
    """
    tree = ast.parse(source)
    docstrings = {id(node): Text(node.lineno, value) for node, value in _docstrings(tree)}
    found = [Text(line, _ENTRY.sub("-", inspect.cleandoc(value))) for line, value in docstrings.values()]
    if messages:
        found += [text for text in _strings(tree, set(docstrings)) if len(_WORD.findall(text.text)) >= FEWEST_WORDS]
    strings = (node for node in ast.walk(tree) if isinstance(node, ast.Constant) and isinstance(node.value, str))
    return [*found, *_comments(source, strings)]


def _docstrings(tree: ast.AST) -> Iterator[tuple[ast.Constant, str]]:
    """Yield the strings that are statements: docstrings, and the descriptions after constants."""
    for node in ast.walk(tree):
        if isinstance(node, _DOCUMENTED):
            for statement in node.body:
                match statement:
                    case ast.Expr(value=ast.Constant(value=str(value)) as constant):
                        yield constant, value


def _strings(node: ast.AST, docstrings: set[int]) -> Iterator[Text]:
    """Yield the other strings; a value in an f-string is shown as `0`."""
    if isinstance(node, ast.JoinedStr):
        parts = [part.value if isinstance(part, ast.Constant) else "0" for part in node.values]
        yield Text(node.lineno, "".join(map(str, parts)))
        return
    if isinstance(node, ast.Constant):
        if isinstance(node.value, str) and id(node) not in docstrings:
            yield Text(node.lineno, node.value)
        return
    for child in ast.iter_child_nodes(node):
        yield from _strings(child, docstrings)


def _comments(source: str, strings: Iterable[ast.Constant]) -> Iterator[Text]:
    """Yield the comments without directives to other tools; consecutive lines of comment are one text.

    Comments are found by their usual form, which is ten times as fast as `tokenize`.
    """
    in_string = {line for node in strings for line in range(node.lineno + 1, (node.end_lineno or node.lineno) + 1)}
    lines: list[str] = []
    start = end = 0
    for number, line in enumerate(source.splitlines(), 1):
        comment = _COMMENT.search(line)
        if comment is None or number in in_string:
            continue
        words = _DIRECTIVE.sub("", comment[1]).strip("# ")
        is_whole_line = not comment.start()
        if lines and is_whole_line and number == end + 1:
            lines.append(words)
        else:
            if lines:
                yield Text(start, "\n".join(lines))
            lines, start = [words], number
        end = number if is_whole_line else -1
    if lines:
        yield Text(start, "\n".join(lines))
