"""Every command line answers `--help` and wrong options without loading what takes long."""

import ast
import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from seventh_axis.__main__ import COMMANDS

ROOT = Path(__file__).parents[1]
SLOW = ("numba", "matplotlib", "scipy", "control", "trimesh")
PROGRAM = """
import argparse, contextlib, importlib, io, json, sys

module, *words = sys.argv[1:]
add_parser, names = argparse._SubParsersAction.add_parser, []
argparse._SubParsersAction.add_parser = lambda self, name, **rest: names.append(name) or add_parser(self, name, **rest)
main = importlib.import_module(module).main

def status(*options):
    with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(io.StringIO()) as said:
        try:
            return main([*words, *options])
        except SystemExit as end:
            return end.code

statuses = [status("--help"), status("--no-such-option")]
for name in dict.fromkeys(names):
    statuses += [status(name, "--help"), status(name, "--no-such-option")]
print(json.dumps([statuses, sorted(name for name in sys.modules if "." not in name)]))
"""


def command_lines() -> list[str]:
    """Return the modules that are programs: they have a `main`, and run it if they are started."""
    found = []
    for package in ("emulator", "planner", "protocol", "tools"):
        for file in sorted((ROOT / package).rglob("*.py")):
            names = file.relative_to(ROOT).with_suffix("").parts
            text = file.read_text(encoding="utf-8")
            if 'if __name__ == "__main__":' in text and "top_level" not in names:
                functions = [node.name for node in ast.parse(text).body if isinstance(node, ast.FunctionDef)]
                found += [".".join(names)] if "main" in functions else []
    return found


def answered(module: str, *words: str) -> tuple[list[int], list[str]]:
    """Return the statuses after `--help` and a wrong option, with each of the commands, and what was imported."""
    environment = os.environ | {"PYTHONPATH": str(ROOT)}
    run = [sys.executable, "-c", PROGRAM, module, *words]
    output = subprocess.run(run, env=environment, capture_output=True, text=True, check=True).stdout
    statuses, modules = json.loads(output)
    return statuses, modules


def test_the_known_command_lines_are_found() -> None:
    assert set(command_lines()) >= {
        "emulator.__main__",
        "planner.__main__",
        "protocol.conformance.__main__",
        "tools.bench.__main__",
        "tools.demo",
        "tools.figures",
        "tools.identify",
        "tools.plot_trace",
        "tools.tune",
    }


@pytest.mark.parametrize("module", command_lines())
def test_help_and_errors_load_nothing_that_takes_long(module: str) -> None:
    statuses, modules = answered(module)
    assert statuses == [0, 2] * (len(statuses) // 2)
    assert not set(modules) & set(SLOW)


@pytest.mark.parametrize("command", COMMANDS)
def test_help_and_errors_of_the_front_door_load_nothing_that_takes_long(command: str) -> None:
    statuses, modules = answered("seventh_axis.__main__", command)
    assert statuses[:2] == [0, 2]
    assert not set(modules) & set(SLOW)
