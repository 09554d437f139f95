"""The shape of the whole: imports run one way, and clocks, ports and threads stay at the edge."""

import ast
import subprocess
import sys
from collections.abc import Iterable, Iterator
from graphlib import TopologicalSorter
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]

MAY_IMPORT = {
    "protocol": {"protocol"},
    "emulator": {"emulator", "protocol"},
    "planner": {"planner", "protocol"},
    "tools": {"emulator", "planner", "protocol", "tools"},
}

PLANNER_LAYERS = ["geometry", "kinematics", "table", "cell", "map", "planning", "execution", "scanning", "commands"]
"""The planner's folders from the lowest up; each may import from those before it, and from the files beside them."""

EDGE_MODULES = {
    "asyncio",
    "datetime",
    "fcntl",
    "multiprocessing",
    "os",
    "pathlib",
    "pty",
    "select",
    "selectors",
    "serial",
    "signal",
    "socket",
    "subprocess",
    "termios",
    "threading",
    "time",
    "tty",
}

PROTOCOL_EDGE = {
    "protocol/clock.py": {"time"},
    "protocol/interrupts.py": {"signal", "threading"},
    "protocol/quiet_start.py": {"os", "signal"},
    "protocol/conformance/__main__.py": {"pathlib"},
    "protocol/conformance/command_line.py": {"os"},
    "protocol/data_file.py": {"pathlib"},
    "protocol/conformance/fixture.py": {"os", "pathlib", "subprocess"},
    "protocol/conformance/host_watch.py": {"os", "select", "threading", "time"},
    "protocol/conformance/ports.py": {"pathlib", "serial"},
    "protocol/conformance/profile.py": {"pathlib"},
    "protocol/conformance/program.py": {"os", "signal", "subprocess"},
    "protocol/conformance/pytest_plugin.py": {"pathlib"},
    "protocol/conformance/record.py": {"pathlib"},
    "protocol/conformance/replay_run.py": {"pathlib"},
    "protocol/conformance/report.py": {"pathlib"},
    "protocol/conformance/stand.py": {"pathlib", "socket"},
    "protocol/conformance/suite_run.py": {"datetime", "os", "pathlib"},
    "protocol/serial_port.py": {"serial"},
}

EMULATOR_EDGE = {
    "__main__",
    "clock",
    "config",
    "control",
    "control_client",
    "device_link",
    "inotify",
    "machine_code_folder",
    "pty_port",
    "readiness",
    "rfc2217_port",
    "server",
    "signals",
    "tcp_port",
    "terminal_baud",
    "trace",
}


def imported_modules(source: Path) -> Iterator[str]:
    """Yield the full name of each module that is imported, those inside functions included."""
    for node in ast.walk(ast.parse(source.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            assert not node.level, f"{source}: a relative import"
            yield from (f"{node.module}.{alias.name}" for alias in node.names)


def module_name(source: Path) -> str:
    return ".".join(source.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__")


def imported_packages(source: Path) -> Iterator[str]:
    return (name.partition(".")[0] for name in imported_modules(source))


def imports_from(packages: Iterable[str], sources: Iterable[Path]) -> list[tuple[str, str]]:
    """Return which source imports what from any of some packages, which are given by their full names."""
    beginnings = tuple(f"{package}." for package in packages)
    return [
        (str(source), name)
        for source in sources
        for name in imported_modules(source)
        if f"{name}.".startswith(beginnings)
    ]


@pytest.mark.parametrize("package", MAY_IMPORT)
def test_imports_run_one_way(package: str) -> None:
    sources = sorted((ROOT / package).rglob("*.py"))
    assert sources
    assert imports_from(MAY_IMPORT.keys() - MAY_IMPORT[package], sources) == []


def test_no_imports_run_in_a_circle() -> None:
    sources = {module_name(source): source for package in MAY_IMPORT for source in (ROOT / package).rglob("*.py")}
    needs = {
        name: {used if used in sources else used.rpartition(".")[0] for used in imported_modules(source)}
        for name, source in sources.items()
    }
    TopologicalSorter(needs).prepare()  # raises a CycleError that names the circle


def test_each_folder_of_the_planner_is_a_layer() -> None:
    assert {source.parent.name for source in (ROOT / "planner").glob("*/*.py")} == set(PLANNER_LAYERS)


@pytest.mark.parametrize("layer", PLANNER_LAYERS)
def test_the_planner_s_layers_import_only_from_those_below(layer: str) -> None:
    above = PLANNER_LAYERS[PLANNER_LAYERS.index(layer) + 1 :]
    assert imports_from([f"planner.{name}" for name in above], (ROOT / "planner" / layer).rglob("*.py")) == []


def test_the_files_beside_the_planner_s_layers_need_none_of_them() -> None:
    sources = set((ROOT / "planner").glob("*.py")) - {ROOT / "planner/__main__.py"}
    assert imports_from([f"planner.{name}" for name in PLANNER_LAYERS], sources) == []


def touched_at_the_edge(package: str) -> dict[str, set[str]]:
    return {
        source.relative_to(ROOT).as_posix(): edge
        for source in (ROOT / package).rglob("*.py")
        if (edge := EDGE_MODULES.intersection(imported_packages(source)))
    }


def test_the_protocol_touches_clock_and_port_at_its_edge_only() -> None:
    assert touched_at_the_edge("protocol") == PROTOCOL_EDGE


def test_the_emulator_touches_clock_ports_and_files_at_its_edge_only() -> None:
    touched = {Path(source).stem for source in touched_at_the_edge("emulator")}
    assert touched - {"__init__", "protocol_emulator"} <= EMULATOR_EDGE  # those two only teach pyserial a port


def test_the_stand_in_starts_with_neither_numpy_nor_numba() -> None:
    program = "import sys, emulator.__main__; print(*({'numpy', 'numba', 'scipy'} & sys.modules.keys()))"
    result = subprocess.run([sys.executable, "-c", program], cwd=ROOT, capture_output=True, text=True, check=True)
    assert result.stdout.strip() == ""
