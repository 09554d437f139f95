"""The structure of the project: imports have one direction, and clocks, ports and threads stay at the edge."""

import ast
import re
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

ROOMS = {
    "planner": [
        "geometry",
        "kinematics",
        "table",
        "cell",
        "map",
        "plans",
        "search",
        "planning",
        "execution",
        "tracking",
        "scanning",
        "adaptive",
        "commands",
    ],
    "emulator": ["plant", "firmware", "line", "faults", "config", "table", "avr", "ports", "server"],
    "protocol/conformance": [
        "profile",
        "bench",
        "judgement",
        "cases",
        "session",
        "results",
        "commands",
        "pytest",
    ],
}
"""The folders of a package in the order in which data travels; each may import from itself and those before it."""

ABOVE_THE_ROOMS = {
    "planner": {"__init__", "__main__", "api"},
    "emulator": {"__init__", "__main__", "control_client", "protocol_compiled", "protocol_emulator", "trace"},
    "protocol/conformance": {"__init__", "__main__"},
}
"""The files beside the rooms that may import from them; all others serve every room."""

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
    "protocol/program/color.py": {"os"},
    "protocol/program/command_line.py": {"os", "pathlib"},
    "protocol/control_channel.py": {"pathlib", "socket"},
    "protocol/program/interrupts.py": {"signal", "threading"},
    "protocol/program/ending.py": {"os"},
    "protocol/kernels/kept_code.py": {"pathlib"},
    "protocol/kernels/kept_file.py": {"fcntl", "os", "pathlib", "time"},
    "protocol/program/progress.py": {"os"},
    "protocol/program/quiet_start.py": {"os", "signal"},
    "protocol/conformance/__main__.py": {"pathlib"},
    "protocol/files/data_file.py": {"pathlib"},
    "protocol/files/toml_table.py": {"pathlib"},
    "protocol/conformance/pytest/fixture.py": {"pathlib", "subprocess"},
    "protocol/conformance/bench/host_watch.py": {"os", "select", "threading", "time"},
    "protocol/conformance/bench/ports.py": {"pathlib", "serial"},
    "protocol/conformance/profile/profile.py": {"pathlib"},
    "protocol/conformance/bench/program.py": {"os", "signal", "subprocess"},
    "protocol/conformance/results/record.py": {"pathlib"},
    "protocol/conformance/commands/replay_run.py": {"pathlib"},
    "protocol/conformance/results/report.py": {"pathlib"},
    "protocol/conformance/bench/stand.py": {"pathlib"},
    "protocol/conformance/commands/suite_run.py": {"datetime", "os", "pathlib"},
    "protocol/program/own_program.py": {"os", "pathlib"},
    "protocol/serial_port.py": {"serial"},
    "protocol/files/whole_file.py": {"os", "pathlib"},
}

EMULATOR_EDGE = {
    "__main__",
    "clock",
    "compiled_table",
    "control_client",
    "control_socket",
    "device_link",
    "inotify",
    "pty_port",
    "readiness",
    "rfc2217_port",
    "server",
    "signals",
    "table_config",
    "tcp_port",
    "terminal_baud",
    "toolchain",
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
    """Return which source imports what from any of some packages, given by their full names."""
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


def test_no_file_uses_two_classes_of_one_name() -> None:
    homes: dict[str, set[str]] = {}
    trees = {
        s: ast.parse(s.read_text(encoding="utf-8"))
        for package in ("emulator", "planner", "protocol", "tools")
        for s in (ROOT / package).rglob("*.py")
    }
    for source, tree in trees.items():
        for node in tree.body:
            if isinstance(node, ast.ClassDef):
                homes.setdefault(node.name, set()).add(module_name(source))
    for source, tree in trees.items():
        met = {(node.name, module_name(source)) for node in tree.body if isinstance(node, ast.ClassDef)}
        for found in ast.walk(tree):
            if isinstance(found, ast.ImportFrom):
                module = str(found.module)
                met |= {(each.name, module) for each in found.names if module in homes.get(each.name, ())}
        names = [name for name, _ in met if name != "Serial"]  # pyserial asks each handler of a URL for that name
        assert len(names) == len(set(names)), (source, sorted(met))


@pytest.mark.parametrize("package", ROOMS)
def test_each_folder_of_a_package_is_a_room_that_says_what_it_is(package: str) -> None:
    assert {source.parent.name for source in (ROOT / package).glob("*/*.py") if package in source.as_posix()} - {
        "conformance"
    } == set(ROOMS[package])
    for room in ROOMS[package]:
        assert ast.get_docstring(ast.parse((ROOT / package / room / "__init__.py").read_text(encoding="utf-8")))


@pytest.mark.parametrize(("package", "room"), [(package, room) for package, rooms in ROOMS.items() for room in rooms])
def test_a_room_imports_only_from_those_before_it(package: str, room: str) -> None:
    name = package.replace("/", ".")
    after = [f"{name}.{other}" for other in ROOMS[package][ROOMS[package].index(room) + 1 :]]
    above = [f"{name}.{module}" for module in ABOVE_THE_ROOMS[package] if module != "__init__"]
    assert imports_from(after + above, (ROOT / package / room).rglob("*.py")) == []


@pytest.mark.parametrize("package", ROOMS)
def test_the_files_beside_the_rooms_need_none_of_them(package: str) -> None:
    name = package.replace("/", ".")
    sources = [source for source in (ROOT / package).glob("*.py") if source.stem not in ABOVE_THE_ROOMS[package]]
    assert imports_from([f"{name}.{room}" for room in ROOMS[package]], sources) == []


SERVICES = ("files", "program", "kernels")
"""The folders of `protocol` that every package needs; each may import from itself and those before it."""


@pytest.mark.parametrize("room", SERVICES)
def test_what_every_package_needs_knows_nothing_of_the_wire(room: str) -> None:
    known = tuple(f"protocol.{name}." for name in SERVICES[: SERVICES.index(room) + 1])
    sources = list((ROOT / "protocol" / room).glob("*.py"))
    assert [found for found in imports_from(["protocol"], sources) if not f"{found[1]}.".startswith(known)] == []
    assert ast.get_docstring(ast.parse((ROOT / "protocol" / room / "__init__.py").read_text(encoding="utf-8")))


CORE = ("plant", "firmware", "line")
"""The rooms of the emulator that another simulator may use: they take constants as values and read no file."""


@pytest.mark.parametrize("room", CORE)
def test_the_core_needs_nothing_but_itself_and_the_standard_library(room: str) -> None:
    ours = tuple(f"emulator.{name}." for name in (*CORE, "int32"))
    for source in (ROOT / "emulator" / room).glob("*.py"):
        for name in imported_modules(source):
            assert f"{name}.".startswith(ours) or name.partition(".")[0] in sys.stdlib_module_names, (source, name)


def test_tools_is_a_namespace_package_that_leaves_room_for_others() -> None:
    assert not (ROOT / "tools" / "__init__.py").exists()


def test_what_is_installed_at_the_top_level_imports_nothing_of_ours_before_it_is_needed() -> None:
    for source in (ROOT / "tools" / "top_level" / "seventh_axis").glob("*.py"):
        at_once = ast.parse(source.read_text(encoding="utf-8")).body
        names = [alias.name for node in at_once if isinstance(node, ast.Import) for alias in node.names]
        names += [str(node.module) for node in at_once if isinstance(node, ast.ImportFrom)]
        assert not MAY_IMPORT.keys() & {name.partition(".")[0] for name in names}, source


def test_every_command_line_is_read_by_the_one_parser() -> None:
    for package in MAY_IMPORT:
        for source in (ROOT / package).rglob("*.py"):
            assert "argparse.ArgumentParser(" not in source.read_text(encoding="utf-8"), source


def test_a_program_of_ours_is_started_so_that_nothing_shadows_it() -> None:
    for package in MAY_IMPORT:
        for source in (ROOT / package).rglob("*.py"):
            if source.name != "own_program.py":
                assert 'sys.executable, "-m"' not in source.read_text(encoding="utf-8"), source


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
    assert (
        touched - {"__init__", "protocol_compiled", "protocol_emulator"} <= EMULATOR_EDGE
    )  # they only teach pyserial a port


TABLE_NAMES = ("table", "bench", "stand", "view", "simulated", "status", "snapshot", "start_emulator")
"""Names of a table, its bench, or its state, alone or as the end of a name."""


def names_a_table(name: str) -> bool:
    return name.rsplit("_", maxsplit=1)[-1] in TABLE_NAMES or name.startswith("table_")


def untyped_tables(tree: ast.AST) -> Iterator[str]:
    """Yield where a table is `Any`, or got at by its name, where types cannot follow."""
    for node in ast.walk(tree):
        name, annotation = "", None
        match node:
            case ast.arg():
                name, annotation = node.arg, node.annotation
            case ast.FunctionDef():
                name, annotation = node.name, node.returns
            case ast.AnnAssign():
                name, annotation = ast.unparse(node.target).rpartition(".")[2], node.annotation
            case ast.Call(func=ast.Name("getattr"), args=[_, ast.Constant("table"), *_]):
                yield ast.unparse(node)
        if annotation is not None and names_a_table(name) and re.search(r"\bAny\b", ast.unparse(annotation)):
            yield f"{name}: {ast.unparse(annotation)}"


@pytest.mark.parametrize("package", [*MAY_IMPORT, "tests"])
def test_no_table_is_untyped(package: str) -> None:
    """mypy holds planner, kit and tools to `protocol.bench` only where nothing of a table is `Any`."""
    found = {
        source.relative_to(ROOT).as_posix(): places
        for source in (ROOT / package).rglob("*.py")
        if (places := list(untyped_tables(ast.parse(source.read_text(encoding="utf-8")))))
    }
    assert found.keys() == ({"protocol/bench.py"} if package == "protocol" else set()), found


@pytest.mark.parametrize(
    "source",
    [
        "def run(table: Any) -> None: ...",
        "def run(*, simulated_table: 'Any | None' = None) -> None: ...",
        "class Port:\n    table: Any",
        "self._table: list[Any] = []",
        "def bench(port: object) -> Any: ...",
        "table = getattr(port, 'table', None)",
    ],
)
def test_an_untyped_table_is_seen(source: str) -> None:
    assert len(list(untyped_tables(ast.parse(source)))) == 1


def test_the_emulator_starts_with_neither_numpy_nor_numba() -> None:
    program = "import sys, emulator.__main__; print(*({'numpy', 'numba', 'scipy'} & sys.modules.keys()))"
    result = subprocess.run([sys.executable, "-c", program], cwd=ROOT, capture_output=True, text=True, check=True)
    assert result.stdout.strip() == ""


@pytest.mark.parametrize(
    "program",
    [
        "emulator",
        "emulator.control_client",
        "planner",
        "protocol.conformance",
        *(
            f"tools.{path.stem}"
            for path in sorted((ROOT / "tools").glob("*.py"))
            if "argparse" in path.read_text("utf-8")
        ),
        "tools.bench",
    ],
)
def test_help_is_printed_without_numba(program: str) -> None:
    code = (
        "import runpy, sys\n"
        f"sys.argv = ['{program}', '--help']\n"
        f"try: runpy.run_module('{program}', run_name='__main__', alter_sys=True)\n"
        "except SystemExit as end: sys.exit(end.code or 'numba' in sys.modules)"
    )
    subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, check=True)
