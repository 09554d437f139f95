import argparse

import pytest

from planner.__main__ import main
from planner.commands.options import fresh_table, positive_number, whole_number


@pytest.mark.parametrize("text", ["8", " 9 ", "360"])
def test_a_whole_number_within_its_bounds_is_read(text: str) -> None:
    assert whole_number(8, 360)(text) == int(text)


@pytest.mark.parametrize("text", ["7", "361", "8.0", "eight", ""])
def test_another_number_is_refused_with_what_is_allowed(text: str) -> None:
    with pytest.raises(argparse.ArgumentTypeError, match=rf"is {text}; allowed is a whole number from 8 to 360"):
        whole_number(8, 360)(text)


@pytest.mark.parametrize("text", ["0", "-1", "nan", "inf", "1e9", "fast"])
def test_a_number_that_is_not_above_0_is_refused(text: str) -> None:
    with pytest.raises(argparse.ArgumentTypeError, match=f"is {text}; allowed is a number above 0 and at most 1000"):
        positive_number(text)


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
    assert f"argument {option[0]}: is {option[1]}; allowed is" in capsys.readouterr().err


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
