"""Mutation testing: small faults in the code that the tests do not find.

`python -m tools.mutation_score --seed N --count N` (`make mutants`) draws mutants of the modules below, and applies
each to a copy of the tree. It runs the tests that mirror the module, then those of the folder. It prints the mutants
that survive, and the share that was killed. A mutant that may survive is listed with its reason in
`mutation_score.toml`.
"""

import protocol.program.quiet_start  # noqa: F401 - before the slow imports

# isort: split
import argparse
import os
import re
import shutil
import subprocess
import sys
import tempfile
import tomllib
from collections import Counter
from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from functools import cache
from pathlib import Path
from queue import SimpleQueue
from random import Random
from typing import Final, NamedTuple

from protocol.program.command_line import Parser, program_name
from protocol.program.ending import ended
from protocol.program.progress import share_shown
from tools.mutation import Mutation, mutated_source, mutations_of

ROOT: Final = Path(__file__).parents[1]
FOLDERS: Final = (
    "emulator/plant",
    "emulator/firmware",
    "emulator/line",
    "planner/kinematics",
    "planner/table",
    "planner/plans",
    "planner/search",
    "planner/planning",
    "planner/execution",
)
EXPLAINED: Final = Path(__file__).with_name("mutation_score.toml")
WANTED: Final = 0.9
"""The share of mutants that the tests must kill, apart from those with a reason."""

_COPIED = ("emulator", "planner", "protocol", "tools", "tests", "pyproject.toml", "docs", "README.md")
_PASSED = frozenset({0, 5})  # 5: there is no test
_HANGS = "a limit of CPU time"
_PYTEST = """
import pytest, sys
try:
    import resource
    resource.setrlimit(resource.RLIMIT_CPU, (600, 600))  # a loaded machine does not count, as it would in a timeout
except ImportError:
    pass  # Windows
sys.exit(pytest.main(sys.argv[1:]))
"""
_OPTIONS = ("-q", "-m", "not realtime", "-p", "no:cacheprovider")


class Score(NamedTuple):
    """The results of the drawn mutants."""

    killed: int
    explained: int
    survivors: list[Mutation]

    @property
    def share(self) -> float:
        """The killed share of those without a reason to survive."""
        return self.killed / max(1, self.killed + len(self.survivors))


def mutated_modules() -> list[str]:
    """Return the full names of the mutated modules, in order."""
    sources = [source for folder in FOLDERS for source in sorted((ROOT / folder).glob("*.py"))]
    names = (source.relative_to(ROOT).with_suffix("").as_posix().replace("/", ".") for source in sources)
    return [name for name in names if not name.endswith(("__init__", "_plots", "_report"))]


def mirroring_tests(module: str) -> list[list[str]]:
    """Return arguments of pytest for the tests of a module, from the nearest on, without those that have run before.

    First those that mirror the module, then those of its folder, then all others that import it.
    """
    *folders, name = module.split(".")
    folder = ROOT / Path("tests", *folders)
    nearest = sorted(folder.glob(f"test_{name}*.py"))
    others = [file for file in _importing_tests(module) if folder not in file.parents]
    relative = [file.relative_to(ROOT).as_posix() for file in (folder, *nearest)]
    return [
        tests
        for tests in (
            relative[1:],
            [relative[0], *(f"--ignore={file}" for file in relative[1:])],
            [file.relative_to(ROOT).as_posix() for file in others],
        )
        if tests
    ]


@cache
def _importing_tests(module: str) -> list[Path]:
    named = re.compile(rf"^\s*(from|import) {re.escape(module)}\b", re.MULTILINE)
    return [file for file in sorted((ROOT / "tests").rglob("test_*.py")) if named.search(file.read_text("utf-8"))]


def killer_of(mutation: Mutation, tree: Path) -> str | None:
    """Plant a mutation in a copy of the tree, and return the test that fails, or None; the copy is whole after that."""
    file = Path(*mutation.module.split(".")).with_suffix(".py")
    (tree / file).write_text(mutated_source(mutation), encoding="utf-8")
    try:
        return next(
            (failed[0] for tests in mirroring_tests(mutation.module) if (failed := _failures(tests, tree, "-x"))), None
        )
    finally:
        shutil.copyfile(ROOT / file, tree / file)


def score(mutations: Sequence[Mutation], jobs: int, reasons: dict[str, str]) -> Score:
    """Return the results of mutations, several at a time; a line is printed for each as soon as it is known.

    A test that fails without a mutant too has killed nothing: its mutants count as survivors.
    """
    killers: dict[Mutation, str] = {}
    explained, survivors = 0, list[Mutation]()
    with _copies(jobs) as copies, share_shown("mutants") as progress:
        for number, (mutation, killer) in enumerate(_verdicts(mutations, copies)):
            if killer is not None:
                killers[mutation] = killer
            elif identity(mutation) in reasons:
                explained += 1
            else:
                survivors.append(mutation)
            print(f"{f'killed by {killer}' if killer else 'survived'}: {mutation.module}: {mutation}", flush=True)
            progress((number + 1) / len(mutations))
        broken = _failures(sorted(set(killers.values()) - {_HANGS}), copies[0]) if killers else []
    for test in broken:
        print(f"fails without a mutant, and kills nothing: {test}")
    survivors += [mutation for mutation, killer in killers.items() if killer in broken]
    return Score(len(mutations) - explained - len(survivors), explained, survivors)


def identity(mutation: Mutation) -> str:
    """Return the identity of a mutation, independent of line numbers: its function and its change."""
    return f"{mutation.where}: {mutation.change}"


def known_reasons(file: Path = EXPLAINED) -> dict[str, str]:
    """Return why mutants may survive, by their identity."""
    entries = tomllib.loads(file.read_text(encoding="utf-8")).get("may", [])
    return {f"{entry['where']}: {entry['change']}": entry["reason"] for entry in entries}


def _verdicts(mutations: Sequence[Mutation], copies: Sequence[Path]) -> Iterator[tuple[Mutation, str | None]]:
    trees: SimpleQueue[Path] = SimpleQueue()
    for copy in copies:
        trees.put(copy)

    def verdict(mutation: Mutation) -> tuple[Mutation, str | None]:
        tree = trees.get()
        try:
            return mutation, killer_of(mutation, tree)
        finally:
            trees.put(tree)

    with ThreadPoolExecutor(len(copies)) as pool:
        try:
            yield from pool.map(verdict, mutations)
        finally:
            pool.shutdown(cancel_futures=True)


@contextmanager
def _copies(count: int) -> Iterator[list[Path]]:
    with tempfile.TemporaryDirectory(prefix="mutants-") as folder:
        copies = [Path(folder, str(number)) for number in range(count)]
        for copy in copies:
            copy.mkdir()
            for name in _COPIED:
                source = ROOT / name
                if source.is_dir():
                    shutil.copytree(source, copy / name, ignore=shutil.ignore_patterns("__pycache__"))
                else:
                    shutil.copy(source, copy / name)
        yield copies


def _failures(tests: Sequence[str], tree: Path, *options: str) -> list[str]:
    """Return the tests that fail, or `_HANGS` if they take too long."""
    present = [test for test in tests if test.startswith("--") or (tree / test.partition("::")[0]).exists()]
    if not present:
        return []
    done = subprocess.run(
        [sys.executable, "-c", _PYTEST, *_OPTIONS, *options, *present],
        cwd=tree,
        env=os.environ | {"PYTHONPATH": str(tree), "PYTHONDONTWRITEBYTECODE": "1"},
        capture_output=True,
        text=True,
        check=False,
    )
    if done.returncode in _PASSED:
        return []
    return re.findall(r"^(?:FAILED|ERROR) (.+?)(?: - .*)?$", done.stdout, re.MULTILINE) or [_HANGS]


def _run(options: argparse.Namespace) -> int:
    everything = mutations_of(mutated_modules())
    chosen = Random(options.seed).sample(everything, min(options.count, len(everything)))  # noqa: S311 - not for security
    found = score(chosen, options.jobs, known_reasons())
    survived = Counter(mutation.module for mutation in found.survivors)
    for module, drawn in sorted(Counter(mutation.module for mutation in chosen).items()):
        print(f"{module:50} {drawn - survived[module]:4} of {drawn:4}")
    survivors = len(found.survivors)
    print(f"{found.killed} killed, {found.explained} may survive, {survivors} survived: {found.share:.1%} killed")
    return int(found.share < WANTED)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line, and return the exit status: 1 if fewer mutants are killed than required."""
    asked = parser()
    options = asked.parse_args(arguments)
    for name in ("count", "jobs"):
        if getattr(options, name) < 1:
            asked.error(f"--{name} {getattr(options, name)}: must be 1 or more")
    return ended("mutation_score", lambda: _run(options))


def parser() -> Parser:
    """Return the parser of the command line."""
    parser = Parser(
        prog=program_name("tools.mutation_score"),
        description="Plant random faults in firmware, plant, line and planner; print those that the tests miss.",
        epilog="example: python -m tools.mutation_score --seed 1 --count 40",
    )
    parser.add_argument("--seed", type=int, default=0, help="random seed of the mutants (default: 0)")
    parser.add_argument("--count", type=int, default=200, help="number of mutants (default: 200)")
    parser.add_argument("--jobs", type=int, default=2, help="number of mutants at a time (default: 2)")
    return parser


if __name__ == "__main__":
    sys.exit(main())
