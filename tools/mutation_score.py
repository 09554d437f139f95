"""Mutation testing: which small faults in the code do the tests not see?

`python -m tools.mutation_score --seed N --count N` (`make mutants`) draws mutants of the modules below, and plants each
in a copy of the tree. It runs the tests that mirror the module, then those of the folder. It prints the mutants that
survive, and the share that was killed. A mutant that may survive is listed with its reason in `mutation_score.toml`.
"""

import protocol.quiet_start  # noqa: F401 - before the imports that take long

# isort: split
import argparse
import os
import shutil
import subprocess
import sys
import tempfile
import tomllib
from collections import Counter
from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from pathlib import Path
from queue import SimpleQueue
from random import Random
from typing import Final, NamedTuple

from protocol.command_line import Parser, program_name
from protocol.ending import ended
from protocol.progress import share_shown
from tools.mutation import Mutation, mutated_source, mutations_of

ROOT: Final = Path(__file__).parents[1]
FOLDERS: Final = (
    "emulator/plant",
    "emulator/firmware",
    "emulator/line",
    "planner/kinematics",
    "planner/table",
    "planner/planning",
    "planner/execution",
)
EXPLAINED: Final = Path(__file__).with_name("mutation_score.toml")
WANTED: Final = 0.9
"""The share of mutants that the tests must kill, apart from those with a reason."""

_COPIED = ("emulator", "planner", "protocol", "tools", "tests", "pyproject.toml", "docs", "README.md")
_TIMEOUT_S = 300.0
_PYTEST = ("-m", "pytest", "-q", "-x", "-m", "not realtime", "-p", "no:cacheprovider")


class Score(NamedTuple):
    """What became of the mutants that were drawn."""

    killed: int
    explained: int
    survivors: list[Mutation]

    @property
    def share(self) -> float:
        """The share that was killed of those without a reason to survive."""
        return self.killed / max(1, self.killed + len(self.survivors))


def mutated_modules() -> list[str]:
    """Return the full names of the modules that are mutated, in order."""
    sources = [source for folder in FOLDERS for source in sorted((ROOT / folder).glob("*.py"))]
    names = (source.relative_to(ROOT).with_suffix("").as_posix().replace("/", ".") for source in sources)
    return [name for name in names if not name.endswith(("__init__", "_plots", "_report"))]


def mirroring_tests(module: str) -> list[list[str]]:
    """Return the tests of a module, from the nearest on: those that mirror it, then those of its folder."""
    *folders, name = module.split(".")
    folder = Path("tests", *folders)
    nearest = [str(file.relative_to(ROOT)) for file in sorted((ROOT / folder).glob(f"test_{name}*.py"))]
    return [tests for tests in (nearest, [str(folder)]) if tests]


def is_killed(mutation: Mutation, tree: Path) -> bool:
    """Plant a mutation in a copy of the tree, and return whether a test fails; the copy is whole again after that."""
    file = Path(*mutation.module.split(".")).with_suffix(".py")
    (tree / file).write_text(mutated_source(mutation), encoding="utf-8")
    try:
        return any(not _pass(tests, tree) for tests in mirroring_tests(mutation.module))
    finally:
        shutil.copyfile(ROOT / file, tree / file)


def score(mutations: Sequence[Mutation], jobs: int, reasons: dict[str, str]) -> Score:
    """Return what becomes of mutations, several at a time."""
    killed = explained = 0
    survivors: list[Mutation] = []
    with share_shown("mutants") as progress:
        for number, (mutation, dead) in enumerate(_verdicts(mutations, jobs)):
            if dead:
                killed += 1
            elif identity(mutation) in reasons:
                explained += 1
            else:
                survivors.append(mutation)
                print(f"survived: {mutation.module}: {mutation}", flush=True)
            progress((number + 1) / len(mutations))
    return Score(killed, explained, survivors)


def identity(mutation: Mutation) -> str:
    """Return what names a mutation where lines move: its function and its change."""
    return f"{mutation.where}: {mutation.change}"


def known_reasons(file: Path = EXPLAINED) -> dict[str, str]:
    """Return why mutants may survive, by their identity."""
    entries = tomllib.loads(file.read_text(encoding="utf-8")).get("may", [])
    return {f"{entry['where']}: {entry['change']}": entry["reason"] for entry in entries}


def _verdicts(mutations: Sequence[Mutation], jobs: int) -> Iterator[tuple[Mutation, bool]]:
    trees: SimpleQueue[Path] = SimpleQueue()

    def verdict(mutation: Mutation) -> tuple[Mutation, bool]:
        tree = trees.get()
        try:
            return mutation, is_killed(mutation, tree)
        finally:
            trees.put(tree)

    with _copies(jobs) as copies, ThreadPoolExecutor(jobs) as pool:
        for copy in copies:
            trees.put(copy)
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


def _pass(tests: Sequence[str], tree: Path) -> bool:
    """Return whether tests pass; those that hang fail. Status 5 means that there are none."""
    environment = os.environ | {"PYTHONPATH": str(tree), "PYTHONDONTWRITEBYTECODE": "1"}
    try:
        done = subprocess.run(
            [sys.executable, *_PYTEST, *tests],
            cwd=tree,
            env=environment,
            capture_output=True,
            check=False,
            timeout=_TIMEOUT_S,
        )
    except subprocess.TimeoutExpired:
        return False
    return done.returncode in {0, 5}


def _run(options: argparse.Namespace) -> int:
    everything = mutations_of(mutated_modules())
    chosen = Random(options.seed).sample(everything, min(options.count, len(everything)))  # noqa: S311 - no secret
    found = score(chosen, options.jobs, known_reasons())
    survived = Counter(mutation.module for mutation in found.survivors)
    for module, drawn in sorted(Counter(mutation.module for mutation in chosen).items()):
        print(f"{module:50} {drawn - survived[module]:4} of {drawn:4}")
    survivors = len(found.survivors)
    print(f"{found.killed} killed, {found.explained} may survive, {survivors} survived: {found.share:.1%} killed")
    return int(found.share < WANTED)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line, and return the exit status: 1 if fewer mutants are killed than wanted."""
    parser = Parser(
        prog=program_name("tools.mutation_score"),
        description="random mutants of firmware, plant, line and planner that the tests do not kill",
        epilog="example: python -m tools.mutation_score --seed 1 --count 40",
    )
    parser.add_argument("--seed", type=int, default=0, help="random seed of the mutants (default: 0)")
    parser.add_argument("--count", type=int, default=200, help="number of mutants (default: 200)")
    parser.add_argument("--jobs", type=int, default=2, help="number of mutants at a time (default: 2)")
    options = parser.parse_args(arguments)
    for name in ("count", "jobs"):
        if getattr(options, name) < 1:
            parser.error(f"--{name} {getattr(options, name)}: must be 1 or more")
    return ended("mutation_score", lambda: _run(options))


if __name__ == "__main__":
    sys.exit(main())
