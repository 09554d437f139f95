"""A small search for wrong tables that the suite passes; the full one is `python -m tools.mutants`."""

import ast
import inspect

import pytest

from emulator.firmware import profiler
from tools import mutants
from tools.mutants import explanations, main, verdict_in_a_process
from tools.mutation import MODULES, mutations_of

ALL = mutations_of(MODULES)


def test_a_mutation_differs_in_one_line_and_leaves_the_source_alone() -> None:
    before = inspect.getsource(profiler)
    for mutation in mutations_of(["emulator.firmware.profiler"]):
        old, _, new = mutation.change.partition(" -> ")
        assert old != new
        assert old.split()[0] in before.splitlines()[mutation.line - 1]
    assert inspect.getsource(profiler) == before
    ast.parse(before)


def test_every_module_of_the_firmware_has_mutations() -> None:
    assert {mutation.module for mutation in ALL} == set(MODULES)
    assert len(ALL) > 500


@pytest.mark.parametrize(
    ("where", "change"),
    [
        ("protocol.line_buffer.LineBuffer._append", ""),
        ("emulator.firmware.fixed_point", "ERROR_BITS - GAIN_BITS"),  # a constant that other modules use
    ],
)
def test_a_wrong_mutant_is_caught_in_a_process_of_its_own(where: str, change: str) -> None:
    index = next(i for i, one in enumerate(ALL) if one.where == where and change in one.change)
    assert verdict_in_a_process(index, 0)


def test_what_may_come_through_is_in_the_code() -> None:
    for one in explanations():
        assert one.reason
        assert any(one.holds_for(mutation) for mutation in ALL), one


def test_a_mutant_that_comes_through_without_a_reason_is_printed(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(mutants, "verdict_in_a_process", lambda _index, _seed: "")
    monkeypatch.setattr(mutants, "explanations", list)
    assert main(["--count", "2"]) == 1
    *found, summary = capsys.readouterr().out.splitlines()
    assert [line.endswith("SURVIVED") for line in found] == [True, True]
    assert summary == "0 caught, 0 survived with a reason, 2 survived"


def test_the_same_seed_gives_the_same_mutants(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(mutants, "verdict_in_a_process", lambda index, _seed: f"caught {index}")
    for _ in range(2):
        assert main(["--count", "5", "--seed", "7", "--all"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[:6] == lines[6:]
