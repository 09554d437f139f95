"""Projects with packages of the same names: they run their tests, and the fixture states what it cannot do."""

import os
import subprocess
import sys
from collections.abc import Mapping
from pathlib import Path

import pytest

USES_THE_FIXTURE = """
def test_a_table_answers(rotary_table):
    assert rotary_table.client.position_deg() == 0
"""


def project(folder: Path, files: Mapping[str, str]) -> Path:
    for name, text in files.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text(text, encoding="utf-8")
    return folder


PYTEST = [str(Path(sys.executable).with_name("pytest"))]
AS_A_MODULE = [sys.executable, "-m", "pytest"]


def run_pytest(
    folder: Path, *words: str, start: list[str] = PYTEST, path: str = ""
) -> subprocess.CompletedProcess[str]:
    """Run pytest like the project: the plug-in is found by its entry point."""
    command = [*start, "-q", "-p", "no:cacheprovider", "-p", "no:hypothesispytest", *words]
    environment = os.environ | {"PYTHONPATH": path}
    return subprocess.run(
        command, cwd=folder, env=environment, capture_output=True, text=True, check=False, timeout=120
    )


@pytest.mark.parametrize(
    "files",
    [
        {"protocol/__init__.py": "NAME = 'mine'\n"},
        {"protocol.py": "NAME = 'mine'\n"},
        {"emulator.py": "NAME = 'mine'\n"},
        {"tools/__init__.py": "NAME = 'mine'\n"},
        {"planner/__init__.py": "NAME = 'mine'\n"},
    ],
    ids=lambda files: next(iter(files)),
)
def test_a_project_with_a_package_of_the_same_name_tests_its_own(files: Mapping[str, str], tmp_path: Path) -> None:
    name = next(iter(files)).partition("/")[0].removesuffix(".py")
    test = f"import {name}\n\ndef test_it_is_mine():\n    assert {name}.NAME == 'mine'\n"
    folder = project(tmp_path, {**files, "test_mine.py": test})
    for start in (PYTEST, AS_A_MODULE):
        result = run_pytest(folder, "-W", "error", start=start)
        assert "1 passed" in result.stdout, result.stdout + result.stderr


def test_a_namespace_folder_tools_is_imported_beside_ours(tmp_path: Path) -> None:
    test = (
        "import tools.mine, tools.command_line\n\n"
        "def test_both_are_there():\n"
        "    assert tools.mine.NAME == 'mine' and tools.command_line.check_folder\n"
    )
    result = run_pytest(project(tmp_path, {"tools/mine.py": "NAME = 'mine'\n", "test_mine.py": test}))
    assert "1 passed" in result.stdout, result.stdout + result.stderr


@pytest.mark.realtime
@pytest.mark.parametrize("is_on_the_path", [False, True])
def test_the_pty_table_is_ours_though_the_project_has_an_emulator(tmp_path: Path, *, is_on_the_path: bool) -> None:
    own = "import pathlib\npathlib.Path('was-run').touch()\n"
    folder = project(tmp_path, {"emulator.py": own, "test_mine.py": USES_THE_FIXTURE})
    result = run_pytest(folder, "--table-port", "pty", path=str(folder) if is_on_the_path else "")
    assert "1 passed" in result.stdout, result.stdout + result.stderr
    assert not (folder / "was-run").exists()


@pytest.mark.parametrize(
    ("file", "words"),
    [
        ("protocol/__init__.py", ()),
        ("protocol/__init__.py", ("--table-port", "pty")),
        ("emulator.py", ()),
        ("serial.py", ()),
    ],
)
def test_the_fixture_says_in_one_sentence_what_hides_our_package(
    file: str, words: tuple[str, ...], tmp_path: Path
) -> None:
    own = "import pathlib\npathlib.Path('was-run').touch()\n"
    folder = project(tmp_path, {file: own, "test_mine.py": USES_THE_FIXTURE})
    result = run_pytest(folder, *words)
    name = file.partition("/")[0].removesuffix(".py")
    hides = (folder / file).parent if "/" in file else folder / file
    owner = "pyserial" if name == "serial" else "seventh-axis"
    assert f"rotary_table: {hides} hides the package {name} of {owner}; " in result.stdout, result.stdout
    assert "Traceback" not in result.stdout + result.stderr
    assert not (folder / "was-run").exists()


@pytest.mark.parametrize("mode", ["prepend", "append", "importlib"])
def test_each_import_mode_finds_the_projects_own_package_as_the_docs_say(mode: str, tmp_path: Path) -> None:
    test = "import protocol\n\ndef test_it_is_mine():\n    assert protocol.NAME == 'mine'\n"
    configuration = '[tool.pytest.ini_options]\npythonpath = ["."]\n'
    files = {"protocol/__init__.py": "NAME = 'mine'\n", "tests/test_mine.py": test, "pyproject.toml": configuration}
    result = run_pytest(project(tmp_path, files), f"--import-mode={mode}")
    assert "1 passed" in result.stdout, result.stdout + result.stderr


def test_a_library_in_the_current_folder_hides_none_of_the_fixtures(tmp_path: Path) -> None:
    wrong = "raise SystemExit('the wrong one')\n"
    folder = project(tmp_path, {**dict.fromkeys(("numpy.py", "control.py"), wrong), "test_mine.py": USES_THE_FIXTURE})
    assert "1 passed" in run_pytest(folder).stdout
