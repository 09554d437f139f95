import subprocess
import sys
from typing import Any

import pytest

from planner.__main__ import main
from planner.commands.options import fresh_table
from planner.planning.planners import PLANNERS


@pytest.mark.parametrize(
    "option",
    [("--decimals", "9"), ("--baud", "-1"), ("--timeout", "0"), ("--tolerance", "nan"), ("--time-scale", "x")],
)
def test_a_run_is_not_begun_with_an_option_that_cannot_be_meant(
    option: tuple[str, str], capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit) as exit_status:
        main(["run", "plan.json", "--port", "emulator://", "--out", "run", *option])
    assert exit_status.value.code == 2
    assert f"{option[0]}: is {option[1]}; allowed:" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("url", "opened"),
    [
        ("emulator://", "emulator://?decimals=3&seed=7"),
        ("emulator://?seed=2", "emulator://?seed=2&decimals=3"),
        ("emulator://?decimals=1&seed=2", "emulator://?decimals=1&seed=2"),
        ("/dev/ttyUSB0", "/dev/ttyUSB0"),
        ("socket://127.0.0.1:7000", "socket://127.0.0.1:7000"),
    ],
)
def test_a_table_made_for_a_command_is_as_the_command_wants_unless_told_others(url: str, opened: str) -> None:
    assert fresh_table(url, decimals=3, seed=7) == opened


@pytest.mark.parametrize(
    "arguments",
    [
        ["--help"],
        ["plan", "--help"],
        ["plan", "mould"],
        ["plan", "mould", "--out", "x", "--configuration", "UPSIDE-DOWN"],
    ],
)
def test_help_and_refusals_are_there_before_anything_big_is_loaded(arguments: list[str]) -> None:
    program = (
        "import sys; from planner.__main__ import main\n"
        "try: main(sys.argv[1:])\n"
        "except SystemExit: pass\n"
        "sys.exit(bool({'numpy', 'scipy', 'matplotlib', 'numba', 'trimesh'} & sys.modules.keys()))"
    )
    subprocess.run([sys.executable, "-c", program, *arguments], check=True, capture_output=True)


def test_each_planner_has_its_name() -> None:
    named: list[Any] = list(PLANNERS.values())
    assert list(PLANNERS) == [planner.__name__ for planner in named]
