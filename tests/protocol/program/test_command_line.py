import logging
import subprocess
import sys

import pytest

from protocol.program import command_line
from protocol.program.command_line import Parser, call_programs, program_name, report, report_error, short_name
from protocol.program.verbose import PACKAGES


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
    monkeypatch.setattr(command_line, "_names", {})
    assert program_name("emulator") == "python -m emulator"
    call_programs({"emulator": "seventh-axis table"})
    assert program_name("emulator") == "seventh-axis table"
    assert program_name("tools.demo") == "python -m tools.demo"


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


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--speed", "fast"], "example: --speed: is fast; allowed is a number (--help shows all options)\n"),
        (["--count", "1.5"], "example: --count: is 1.5; allowed is a whole number (--help shows all options)\n"),
        (["--unit", "m"], "example: --unit: is m; allowed are mm, inch (--help shows all options)\n"),
        (["--unit", "inhc"], "allowed are mm, inch; did you mean inch? (--help"),
    ],
)
def test_a_value_that_cannot_be_used_is_named_with_what_is_allowed(
    words: list[str], said: str, capsys: pytest.CaptureFixture[str]
) -> None:
    parser = Parser(prog="python -m tools.example")
    parser.add_argument("--speed", type=float)
    parser.add_argument("--count", type=int)
    parser.add_argument("--unit", choices=("mm", "inch"))
    with pytest.raises(SystemExit):
        parser.parse_args(words)
    assert said in capsys.readouterr().err


def test_only_an_error_is_colored(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("NO_COLOR", raising=False)
    monkeypatch.setenv("FORCE_COLOR", "1")
    report("python -m emulator", "is ready")
    report_error("python -m emulator", "--tcp: is in use")
    assert capsys.readouterr().err == "emulator: is ready\n\x1b[31memulator:\x1b[0m --tcp: is in use\n"


def test_a_message_that_nobody_reads_leaves_the_program_running() -> None:
    program = "from protocol.program.command_line import report; report('tool', 'x' * 100_000); print('went on')"
    with subprocess.Popen([sys.executable, "-c", program], stdout=subprocess.PIPE, stderr=subprocess.PIPE) as process:
        assert process.stderr is not None
        process.stderr.close()
        assert process.stdout is not None
        assert process.stdout.read() == b"went on\n"
    assert process.returncode == 0


@pytest.mark.parametrize("words", [["-v", "part", "file"], ["part", "file", "--verbose"]])
def test_the_option_for_debug_messages_stands_before_or_after_a_command(
    words: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    parser = Parser(prog="python -m example")
    parser.add_subparsers(dest="command").add_parser("part").add_argument("file")
    try:
        options = parser.parse_args(words)
        logging.getLogger("protocol.dialogue").debug("sent %r", b"H\r")
    finally:
        for logger in map(logging.getLogger, PACKAGES):
            logger.handlers, logger.level = [], logging.NOTSET
    assert vars(options) == {"command": "part", "file": "file"}
    assert capsys.readouterr().err.endswith(" s protocol.dialogue: sent b'H\\r'\n")
