import pytest

from protocol import command_line
from protocol.command_line import Parser, program_name, run_as, short_name


@pytest.mark.parametrize(
    ("prog", "name"),
    [
        ("python -m emulator", "emulator"),
        ("python -m tools.tune", "tune"),
        ("python -m planner map", "planner map"),
        ("seventh-axis table", "seventh-axis table"),
    ],
)
def test_a_message_begins_with_the_short_name(prog: str, name: str) -> None:
    assert short_name(prog) == name


def test_a_program_is_called_as_it_was_started(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(command_line, "_names", [])
    assert program_name("emulator") == "python -m emulator"
    run_as("seventh-axis table")
    assert program_name("emulator") == "seventh-axis table"


@pytest.mark.parametrize("words", [["--speed"], ["--spe", "3"], ["--speed", "fast"], ["more"]])
def test_a_command_line_that_cannot_be_used_is_one_line_and_status_2(
    words: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    parser = Parser(prog="python -m tools.example")
    parser.add_argument("--speed", type=float)
    with pytest.raises(SystemExit) as ended:
        parser.parse_args(words)
    assert ended.value.code == 2
    said = capsys.readouterr().err
    assert said.startswith("example: ")
    assert said.count("\n") == 1


def test_a_subcommand_is_read_by_the_same_parser(capsys: pytest.CaptureFixture[str]) -> None:
    parser = Parser(prog="python -m example")
    parser.add_subparsers().add_parser("part").add_argument("file")
    with pytest.raises(SystemExit):
        parser.parse_args(["part"])
    assert capsys.readouterr().err.startswith("example part: ")


def test_the_whole_command_line_is_kept_as_a_shell_reads_it() -> None:
    parser = Parser(prog="python -m tools.tune")
    parser.add_argument("--out")
    options = parser.read(["--out", "a folder"])
    assert options.out == "a folder"
    assert options.command_line == "python -m tools.tune --out 'a folder'"
