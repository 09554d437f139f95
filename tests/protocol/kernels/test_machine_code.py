"""Machine code is stored under its digest: a small package is edited, and each run prints how much was compiled."""

import os
import pickle
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from protocol.kernels import kept_file

ROOT = Path(__file__).parents[3]

PARTS = """
from typing import NamedTuple
STEP = 1.0

class Pair(NamedTuple):
    first: float
    second: float

def added(number, more=10.0):
    return number + more + STEP
"""
WHOLE = """
from numba.core import event
from parts import Pair, added
from planner.kernel import kernel
from protocol.kernels.machine_code import compiled

added = kernel(added)

@kernel
def whole(pair):
    return added(pair.first) - pair.second  # a comment

class Counter(event.Listener):
    count = 0
    def on_start(self, _event):
        self.count += 1
    def on_end(self, _event):
        pass

counter = Counter()
event.register("numba:compile", counter)
print(whole(Pair(3.0, 1.0)), counter.count)
"""


class Checkout:
    """A copy of the package, and how it is run."""

    def __init__(self, folder: Path, cache: Path) -> None:
        folder.mkdir()
        self.folder, self.cache = folder, cache
        (folder / "parts.py").write_text(PARTS)
        (folder / "whole.py").write_text(WHOLE)

    def edit(self, file: str, old: str, new: str) -> None:
        text = (self.folder / file).read_text()
        assert old in text
        (self.folder / file).write_text(text.replace(old, new))

    def start(self) -> "subprocess.Popen[str]":
        environment = {**os.environ, "PYTHONPATH": str(ROOT), "XDG_CACHE_HOME": str(self.cache)}
        environment.pop("NUMBA_CACHE_DIR", None)
        return subprocess.Popen(
            [sys.executable, "-B", "whole.py"], cwd=self.folder, env=environment, stdout=subprocess.PIPE, text=True
        )

    def run(self) -> tuple[float, int]:
        """Return what the kernel gives, and how many functions were compiled for that."""
        return result_of(self.start())


def result_of(process: "subprocess.Popen[str]") -> tuple[float, int]:
    output, _ = process.communicate(timeout=120)
    assert process.returncode == 0
    number, count = output.split()
    return float(number), int(count)


@pytest.fixture
def checkout(tmp_path: Path) -> Checkout:
    return Checkout(tmp_path / "one", tmp_path / "cache")


FACTORY = """
from planner.kernel import kernel

def scaled_by(factor):
    @kernel
    def part(number):
        return factor * number if number < 9.0 else part(number - 1.0)

    @kernel
    def scaled(number):
        return part(number)

    return scaled
"""


def scaled_in_another_process(folder: Path, *factors: float) -> list[float]:
    """Return what functions of one name and type give that were made, and compiled or loaded, in a new process."""
    (folder / "factory.py").write_text(FACTORY)
    program = f"from factory import scaled_by; print(*[scaled_by(factor)(1.0) for factor in {factors}])"
    environment = {**os.environ, "PYTHONPATH": str(ROOT), "NUMBA_CACHE_DIR": str(folder / "cache")}
    run = [sys.executable, "-B", "-c", program]
    output = subprocess.run(run, cwd=folder, env=environment, capture_output=True, text=True, check=True).stdout
    return [float(number) for number in output.split()]


def test_code_of_two_processes_is_not_mixed_up_in_a_third(tmp_path: Path) -> None:
    assert scaled_in_another_process(tmp_path, 2.0) == [2.0]
    assert scaled_in_another_process(tmp_path, 3.0) == [3.0]
    assert scaled_in_another_process(tmp_path, 4.0, 2.0, 3.0) == [4.0, 2.0, 3.0]


def kept_files(checkout: Checkout) -> list[Path]:
    return [file for file in checkout.cache.rglob("*") if file.is_file()]


def test_code_is_compiled_once_and_again_only_when_it_has_changed(checkout: Checkout, tmp_path: Path) -> None:
    assert checkout.run() == (13.0, 2)
    checkout.edit("whole.py", "# a comment", "# another\n")
    assert checkout.run() == (13.0, 0)
    other = Checkout(tmp_path / "other", checkout.cache)
    other.edit("parts.py", "STEP = 1.0", "STEP = 2.0")
    assert other.run() == (14.0, 2)
    assert checkout.run() == (13.0, 0)  # two checkouts in turn
    assert other.run() == (14.0, 0)
    assert len(kept_files(checkout)) == 2
    other.edit("parts.py", "more=10.0", "more=20.0")
    assert other.run() == (24.0, 2)
    other.edit("parts.py", "first: float\n    second: float", "second: float\n    first: float")
    assert other.run() == (20.0, 2)


def test_a_file_that_is_damaged_or_holds_something_else_is_replaced(checkout: Checkout) -> None:
    assert checkout.run() == (13.0, 2)
    [file] = kept_files(checkout)
    whole = file.read_bytes()
    others = [b"no pickle", pickle.dumps((None,) * 9)]
    sealed = [kept_file._seal(file.name, other) + other for other in others]  # noqa: SLF001  # as another version may
    for content in (whole[: len(whole) // 2], *sealed):
        file.write_bytes(content)
        assert checkout.run() == (13.0, 2)
        assert len(file.read_bytes()) > len(whole) // 2
    assert checkout.run() == (13.0, 0)


def test_code_is_compiled_for_the_settings_of_numba(checkout: Checkout, monkeypatch: pytest.MonkeyPatch) -> None:
    assert checkout.run() == (13.0, 2)
    monkeypatch.setenv("NUMBA_LOOP_VECTORIZE", "0")
    assert checkout.run() == (13.0, 2)
    monkeypatch.setenv("NUMBA_NUM_THREADS", "1")
    assert checkout.run() == (13.0, 0)


def test_kernels_run_interpreted_where_numba_is_told_not_to_compile(
    checkout: Checkout, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("NUMBA_DISABLE_JIT", "1")
    assert checkout.run() == (13.0, 0)


def test_without_a_folder_that_can_be_written_code_is_compiled_each_time(checkout: Checkout) -> None:
    checkout.cache.write_text("a file in the place of the folder")
    assert checkout.run() == (13.0, 2)
    assert checkout.run() == (13.0, 2)


def test_processes_that_compile_at_once_leave_one_whole_file(checkout: Checkout) -> None:
    processes = [checkout.start() for _ in range(3)]
    assert {result_of(process)[0] for process in processes} == {13.0}
    assert len(kept_files(checkout)) == 1
    assert checkout.run() == (13.0, 0)


LISTING = """
import importlib, pkgutil, sys
import planner
from planner.kernel import _Kernel
from protocol.kernels.kept_code import code_name
for module in pkgutil.walk_packages(planner.__path__, "planner."):
    if not module.name.endswith("__main__"):
        for name, value in sorted(vars(importlib.import_module(module.name)).items()):
            if isinstance(value, _Kernel) and value.py_func.__module__ == module.name:
                print(module.name, name, code_name(value.py_func))
assert "numba" not in sys.modules
"""


def names_of_kernels(root: Path) -> dict[str, str]:
    environment = {**os.environ, "PYTHONPATH": str(root)}
    run = [sys.executable, "-B", "-c", LISTING]
    output = subprocess.run(run, cwd=root, env=environment, capture_output=True, text=True, check=True).stdout
    return {line.rpartition(" ")[0]: line.rpartition(" ")[2] for line in output.splitlines()}


def test_every_kernel_of_the_planner_is_kept_whatever_is_said_about_it(tmp_path: Path) -> None:
    before = names_of_kernels(ROOT)
    assert len(before) > 100
    assert "None" not in before.values()
    for package in ("planner", "protocol"):
        shutil.copytree(ROOT / package, tmp_path / package, ignore=shutil.ignore_patterns("__pycache__"))
    for source in (tmp_path / "planner").rglob("*.py"):
        source.write_text("# A comment.\n" + source.read_text(encoding="utf-8").replace('"""Return ', '"""Give '))
    bodies = tmp_path / "planner/cell/bodies.py"
    bodies.write_text(bodies.read_text() + "\n\nUNUSED = 1\n")
    capsule = tmp_path / "planner/geometry/capsule.py"
    text = capsule.read_text()
    assert "0.0" in text
    capsule.write_text(text.replace("0.0", "1e-300"))
    after = names_of_kernels(tmp_path)
    changed = {name for name in before if before[name] != after[name]}
    assert "planner.geometry.capsule segment_distance" in changed
    assert "planner.map.map_builder rate_columns" in changed
    assert not [
        name
        for name in changed
        if name.startswith(("planner.plans", "planner.search", "planner.planning", "planner.table"))
    ]
