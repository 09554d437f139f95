"""Mutation testing at a small size: drawn mutants, selected tests, and the detection of a fault."""

import shutil
from contextlib import nullcontext
from pathlib import Path

import pytest

from tools import mutation_score
from tools.mutation import Mutation, mutated_source, mutations_of
from tools.mutation_score import (
    FOLDERS,
    ROOT,
    identity,
    killer_of,
    known_reasons,
    main,
    mirroring_tests,
    mutated_modules,
    score,
)

FRAMING = "emulator.line.framing"


def test_every_folder_has_modules_and_each_module_has_tests() -> None:
    modules = mutated_modules()
    for folder in FOLDERS:
        assert any(module.startswith(folder.replace("/", ".")) for module in modules)
    for module in modules:
        assert all(
            (ROOT / test.removeprefix("--ignore=")).exists() for tests in mirroring_tests(module) for test in tests
        )


def test_the_tests_that_mirror_a_module_come_first() -> None:
    nearest, folder, importing = mirroring_tests(FRAMING)
    assert nearest == ["tests/emulator/line/test_framing.py"]
    assert folder == ["tests/emulator/line", "--ignore=tests/emulator/line/test_framing.py"]
    assert all(FRAMING in (ROOT / test).read_text(encoding="utf-8") for test in importing)


def copied(tmp_path: Path) -> Path:
    for name in ("emulator", "protocol"):
        shutil.copytree(ROOT / name, tmp_path / name, ignore=shutil.ignore_patterns("__pycache__"))
    tests = tmp_path / "tests" / "emulator" / "line"
    tests.mkdir(parents=True)
    shutil.copy(ROOT / "tests/emulator/line/test_framing.py", tests)
    shutil.copy(ROOT / "pyproject.toml", tmp_path)
    return tmp_path


def test_a_fault_that_a_test_sees_is_killed_and_the_copy_is_whole_again(tmp_path: Path) -> None:
    tree, source = copied(tmp_path), ROOT / "emulator/line/framing.py"
    mutation = next(one for one in mutations_of([FRAMING]) if one.change.startswith("RATE_TOLERANCE"))
    assert mutated_source(mutation) != source.read_text(encoding="utf-8")
    assert str(killer_of(mutation, tree)).startswith("tests/emulator/line/test_framing.py::")
    assert (tree / "emulator/line/framing.py").read_bytes() == source.read_bytes()


def test_a_fault_that_no_test_sees_survives(tmp_path: Path) -> None:
    tree = copied(tmp_path)
    (tree / "tests/emulator/line/test_framing.py").write_text("def test_nothing() -> None:\n    pass\n")
    assert killer_of(mutations_of([FRAMING])[0], tree) is None


@pytest.mark.parametrize(("dead", "status"), [(True, 0), (False, 1)])
def test_the_status_says_whether_enough_mutants_are_killed(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], dead: bool, status: int
) -> None:
    monkeypatch.setattr(mutation_score, "killer_of", lambda _mutation, _tree: "a test" if dead else None)
    monkeypatch.setattr(mutation_score, "known_reasons", dict)
    monkeypatch.setattr(mutation_score, "_COPIED", ())
    assert main(["--count", "3"]) == status
    assert capsys.readouterr().out.splitlines()[-1].endswith("100.0% killed" if dead else "0.0% killed")


def test_a_survivor_with_a_reason_does_not_count(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(mutation_score, "killer_of", lambda _mutation, _tree: None)
    monkeypatch.setattr(mutation_score, "_COPIED", ())
    explained, other = mutations_of([FRAMING])[:2]
    found = score([explained, other], 1, {identity(explained): "equal"})
    assert (found.killed, found.explained, found.survivors, found.share) == (0, 1, [other], 0.0)


def test_a_test_that_fails_without_a_mutant_kills_nothing(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    tree = copied(tmp_path)
    (tree / "tests/emulator/line/test_framing.py").write_text("def test_broken() -> None:\n    assert False\n")
    monkeypatch.setattr(mutation_score, "_copies", lambda _count: nullcontext([tree]))
    mutation = mutations_of([FRAMING])[0]
    found = score([mutation], 1, {})
    assert (found.killed, found.survivors) == (0, [mutation])
    assert "kills nothing: tests/emulator/line/test_framing.py::test_broken" in capsys.readouterr().out


def test_each_reason_is_about_a_mutant_that_there_is() -> None:
    identities = {identity(mutation) for mutation in all_mutations()}
    assert known_reasons().keys() <= identities
    assert all(known_reasons().values())


def all_mutations() -> list[Mutation]:
    return mutations_of(mutated_modules())
