"""The shape of the whole: imports run one way, and clocks, ports and threads stay at the edge."""

import ast
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]

MAY_IMPORT = {
    "protocol": {"protocol"},
    "emulator": {"emulator", "protocol"},
    "planner": {"planner", "protocol"},
    "tools": {"emulator", "planner", "protocol", "tools"},
}

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
    "protocol/client.py": {"serial"},
    "protocol/clock.py": {"time"},
    "protocol/conformance/__main__.py": {"pathlib"},
    "protocol/conformance/command_line.py": {"os", "signal"},
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
}

EMULATOR_EDGE = {
    "__main__",
    "clock",
    "config",
    "control",
    "control_client",
    "device_link",
    "inotify",
    "pty_port",
    "server",
    "signals",
    "tcp_port",
    "terminal_baud",
    "trace",
}


def imported_packages(source: Path) -> Iterator[str]:
    """Yield the top-level name of each import, those inside functions included."""
    for node in ast.walk(ast.parse(source.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            yield from (alias.name.partition(".")[0] for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            yield source.relative_to(ROOT).parts[0] if node.level else str(node.module).partition(".")[0]


@pytest.mark.parametrize("package", MAY_IMPORT)
def test_imports_run_one_way(package: str) -> None:
    forbidden = MAY_IMPORT.keys() - MAY_IMPORT[package]
    sources = sorted((ROOT / package).rglob("*.py"))
    assert sources
    wrong = [(str(source), name) for source in sources for name in imported_packages(source) if name in forbidden]
    assert wrong == []


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
