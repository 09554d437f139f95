"""Every example in the README and the docs is run, and gives the output on the page.

A `console` block contains commands after `$ ` and their output; a command that ends in `&` runs until the page ends. A
`python` block is an interactive session. `...` matches anything. The blocks of a page follow one another.
"""

import doctest
import os
import re
import subprocess
import sys
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Any

import pytest

ROOT = Path(__file__).parents[1]
PAGES = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted((ROOT / "docs").glob("*.md"))]
BLOCK = re.compile(r"^```(console|python)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
COMMAND = re.compile(r"^\$ (.*)\n((?:(?!\$ ).*\n)*)", re.MULTILINE)
LINK = re.compile(r"\]\((?!http)([^)#]+)[^)]*\)")
OPTIONS = doctest.ELLIPSIS | doctest.NORMALIZE_WHITESPACE | doctest.IGNORE_EXCEPTION_DETAIL


@pytest.mark.realtime
@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_the_examples_of_a_page_give_what_it_says(page: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    names: dict[str, Any] = {}
    with ExitStack() as background:
        for kind, text in BLOCK.findall(page.read_text(encoding="utf-8")):
            if kind == "python":
                run_session(text, names, page.name)
            else:
                for command, expected in COMMAND.findall(text):
                    run_command(command, expected, background)


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_the_links_of_a_page_lead_somewhere(page: Path) -> None:
    missing = [link for link in LINK.findall(page.read_text(encoding="utf-8")) if not (page.parent / link).exists()]
    assert not missing


def run_session(text: str, names: dict[str, Any], page: str) -> None:
    examples = doctest.DocTestParser().get_doctest(text, names, page, page, 0)
    runner = doctest.DocTestRunner(optionflags=OPTIONS, verbose=False)
    report: list[str] = []
    runner.run(examples, out=report.append, clear_globs=False)
    names.update(examples.globs)
    assert runner.summarize(verbose=False).failed == 0, "".join(report)


def run_command(command: str, expected: str, background: ExitStack) -> None:
    if command.endswith("&"):
        got = background.enter_context(running(command.removesuffix("&")))
    else:
        got = subprocess.run(  # noqa: S602  # the pages' commands are our own, and written for a shell
            command, shell=True, env=environment(), check=False, text=True, stdout=subprocess.PIPE, timeout=120
        ).stdout
    assert doctest.OutputChecker().check_output(expected, got, OPTIONS), f"$ {command}\n{got}"


@contextmanager
def running(command: str) -> Iterator[str]:
    with subprocess.Popen(  # noqa: S602  # as above
        f"exec {command}", shell=True, env=environment(), stdout=subprocess.PIPE, text=True
    ) as process:
        assert process.stdout is not None
        try:
            yield process.stdout.readline()
        finally:
            process.terminate()


def environment() -> dict[str, str]:
    path = os.pathsep.join((str(Path(sys.executable).parent), os.environ["PATH"]))
    return os.environ | {"PATH": path, "PYTHONPATH": str(ROOT)}
