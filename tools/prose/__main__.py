"""Check the prose of docs, help texts and Python source: python -m tools.prose [FILE ...]. Status 1 for any finding."""

import argparse
import sys
from collections.abc import Iterator
from pathlib import Path

from protocol.program.command_line import Parser
from tools.prose.rules import Finding, findings, load_rules, python_findings
from tools.reference.command_pages import options, programs, subcommands

ROOT = Path(__file__).parents[2]
PACKAGES = ("protocol", "emulator", "planner", "tools", "tests")


def main(arguments: list[str] | None = None) -> int:
    """Print each finding with its place and what to write, and return the exit status."""
    parser = Parser(prog="python -m tools.prose", description="Check the prose of docs, help texts and Python source.")
    parser.add_argument("files", metavar="FILE", type=Path, nargs="*", help="Markdown or Python files (default: all)")
    given = parser.parse_args(arguments).files
    count = 0
    for place, finding in files(given) if given else everything():
        print(f"{place}:{finding.line}: {finding.words!r}: write {finding.instead}")
        count += 1
    return 1 if count else 0


def everything() -> Iterator[tuple[str, Finding]]:
    """Yield the findings in the README, the docs, all Python source and all help texts."""
    pages = [*ROOT.glob("*.md"), *(ROOT / "docs").glob("*.md")]
    sources = [file for package in PACKAGES for file in (ROOT / package).rglob("*.py")]
    yield from files([*sorted(pages), *sorted(sources)])
    for module, parser in programs().items():
        yield from help_texts(module, parser)
        for name, command in subcommands(parser).items():
            yield from help_texts(f"{module} {name}", command)


def files(paths: list[Path]) -> Iterator[tuple[str, Finding]]:
    """Yield the findings in Markdown and Python files; the strings of a test are data, and not messages."""
    rules = load_rules()
    for path in paths:
        text = path.read_text(encoding="utf-8")
        if path.suffix == ".py":
            found = python_findings(text, rules, messages="tests" not in path.relative_to(path.anchor).parts)
        else:
            found = findings(text, rules, markdown=True)
        for finding in found:
            yield str(path), finding


def help_texts(name: str, parser: argparse.ArgumentParser) -> Iterator[tuple[str, Finding]]:
    """Yield the findings in the description, the examples and the options of a command; lines count in that text."""
    rules = load_rules()
    texts = {"description": parser.description, "epilog": parser.epilog}
    texts |= {" ".join(action.option_strings) or action.dest: action.help for action in options(parser)}
    for part, text in texts.items():
        for finding in findings(text or "", rules, markdown=False):
            yield f"help of {name}: {part}", finding


if __name__ == "__main__":
    sys.exit(main())
