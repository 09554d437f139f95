"""The command `seventh-axis`: it starts the same programs as `python -m ...`, from any folder."""

import os
import re
import subprocess
import sys
from importlib import import_module
from importlib.metadata import version
from pathlib import Path

import pytest

from seventh_axis.__main__ import COMMANDS, main

FRONT_DOOR = Path(sys.executable).with_name("seventh-axis")


def run(folder: Path, *words: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run([FRONT_DOOR, *words], cwd=folder, capture_output=True, text=True, check=False, timeout=60)


@pytest.mark.parametrize("name", COMMANDS)
def test_each_command_leads_to_a_program_that_calls_itself_so(
    name: str, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("protocol.program.command_line._names", {})
    with pytest.raises(SystemExit) as ended:
        main([name, "--help"])
    assert ended.value.code == 0
    shown = capsys.readouterr().out
    assert shown.startswith(f"usage: seventh-axis {name} ")
    assert not re.findall(r"python\s+-m\s+(?:emulator|planner|protocol|tools)", shown)
    assert "--verbose" in shown
    assert import_module(COMMANDS[name].module).parser().format_help()


@pytest.mark.parametrize("name", COMMANDS)
def test_each_module_that_is_started_by_python_calls_itself_so(name: str) -> None:
    shown = import_module(COMMANDS[name].module).parser().format_help()
    assert shown.startswith(f"usage: python -m {COMMANDS[name].module.removesuffix('.__main__')} ")
    assert "seventh-axis" not in shown


def test_the_option_for_debug_messages_may_stand_before_the_command(tmp_path: Path) -> None:
    done = run(tmp_path, "-v", "conform", "--port", "emulator://", "--case", "7.1/1", "--out", "out")
    assert done.returncode == 0
    assert "protocol.conformance.session.suite: case 7.1/1\n" in done.stderr
    assert "protocol.files.whole_file: wrote out/report.html\n" in done.stderr
    assert "s protocol." not in run(tmp_path, "conform", "--list", "--case", "7.1/1").stderr


def test_a_command_runs_and_its_status_is_passed_on(tmp_path: Path) -> None:
    assert run(tmp_path, "conform", "--list", "--case", "5.3").stdout.startswith("5.3/1 ")
    refused = run(tmp_path, "conform", "--port", "/dev/no-such-table", "--out", "out")
    assert refused.returncode == 2
    assert refused.stderr.count("\n") == 1


def test_what_is_in_the_current_folder_hides_nothing(tmp_path: Path) -> None:
    for name in ("emulator.py", "protocol.py", "tools.py"):
        (tmp_path / name).write_text("raise SystemExit('the wrong one')\n", encoding="utf-8")
    assert run(tmp_path, "table", "--help").returncode == 0


def test_a_package_that_hides_ours_is_named_in_one_line(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "emulator.py").write_text("raise SystemExit('the wrong one')\n", encoding="utf-8")
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    hidden = run(tmp_path, "table", "--help")
    assert hidden.returncode == 2
    assert hidden.stderr.startswith(f"seventh-axis: {tmp_path / 'emulator.py'} hides the package emulator ")
    assert run(tmp_path, "conform", "--help").returncode == 0


def test_the_version_is_that_of_the_distribution(tmp_path: Path) -> None:
    assert run(tmp_path, "--version").stdout == f"seventh-axis {version('seventh-axis')}\n"
    assert run(tmp_path, "version").stdout.startswith(f"seventh-axis {version('seventh-axis')} in ")


@pytest.mark.parametrize(
    ("words", "said"), [([], "COMMAND"), (["tabel"], "is tabel; allowed are"), (["--tabel"], "COMMAND")]
)
def test_what_is_no_command_is_one_line_and_status_2(words: list[str], said: str, tmp_path: Path) -> None:
    done = run(tmp_path, *words)
    assert done.returncode == 2
    assert said in done.stderr
    assert done.stderr.startswith("seventh-axis: ")
    assert done.stderr.count("\n") == 1


def completed(line: str, folder: Path) -> set[str]:
    """Return the completions of a line for the shell."""
    offered = folder / "offered"
    offered.touch()
    shell = {"_ARGCOMPLETE": "1", "COMP_LINE": line, "COMP_POINT": str(len(line)), "_ARGCOMPLETE_IFS": "\n"}
    environment = os.environ | shell | {"_ARGCOMPLETE_STDOUT_FILENAME": str(offered)}
    subprocess.run([FRONT_DOOR], cwd=folder, env=environment, check=True, capture_output=True, timeout=60)
    return {word.strip() for word in offered.read_text(encoding="utf-8").splitlines()}


def test_commands_and_their_options_are_completed(tmp_path: Path) -> None:
    assert completed("seventh-axis t", tmp_path) == {"table", "tune", "trace", "track"}
    assert completed("seventh-axis table --t", tmp_path) == {"--tcp", "--time-scale", "--trigger-hz", "--trace"}
    assert completed("seventh-axis plan cylinder --sm", tmp_path) == {"--smooth"}
    assert completed("seventh-axis control ./socket fault-h", tmp_path) == {"fault-half-reply", "fault-hang-up"}


def test_completing_a_line_runs_nothing(tmp_path: Path) -> None:
    completed("seventh-axis conform --list ", tmp_path)
    completed("seventh-axis table --tcp 0 --trace run.csv ", tmp_path)
    assert [path.name for path in tmp_path.iterdir()] == ["offered"]


def test_without_argcomplete_completing_a_line_runs_nothing(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setitem(sys.modules, "argcomplete", None)
    monkeypatch.setenv("_ARGCOMPLETE", "1")
    assert main(["conform", "--list"]) == 2
    assert capsys.readouterr().out == ""
