"""Each soak at a small size; `python -m tools.soak` runs the full ones."""

import pytest

from tools.soak import SOAKS, main


@pytest.mark.parametrize(("name", "size"), [("noise", 100_000), ("day", 0.1), ("wrap", 4)])
def test_a_short_soak_finds_nothing(name: str, size: float) -> None:
    assert SOAKS[name][0](size, 1).faults == []


@pytest.mark.realtime
def test_clients_that_come_and_go_leave_nothing_behind() -> None:
    assert SOAKS["clients"][0](25, 1).faults == []


def test_the_command_line_prints_the_figures(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["wrap", "--share", "0.02"]) == 0
    assert capsys.readouterr().out == "wrap: wraps 2\n"
