from pathlib import Path

import pytest

from emulator import Table, load_config
from emulator.trace import TraceWriter, read_trace
from tools.plot_trace import commands_of, main


@pytest.fixture(scope="module")
def trace_path(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A motion that is pre-empted twice, as in Fig. 4 of the paper."""
    path = tmp_path_factory.mktemp("trace") / "run.csv"
    table = Table(load_config())
    with TraceWriter(path, 1000) as trace:
        table.observer = trace.record
        table.advance(500)
        for commands, ticks in ((b"S 20\rA 20\rP 90\r", 2500), (b"S 35\rP 120\r", 2000), (b"H\rP 80\r", 6000)):
            table.receive(commands)
            table.advance(ticks)
    return path


def test_commands_are_found_where_they_were_received(trace_path: Path) -> None:
    commands = commands_of(read_trace(trace_path))
    assert [text for _, text in commands] == ["S 20", "A 20", "P 90", "S 35", "P 120", "P 80"]
    assert commands[2][0] == pytest.approx(0.515, abs=0.01)
    assert commands[4][0] == pytest.approx(3.011, abs=0.01)


@pytest.mark.parametrize(("name", "signature"), [("run.png", b"\x89PNG"), ("run.svg", b"<?xml"), ("run.pdf", b"%PDF")])
def test_a_picture_is_drawn(trace_path: Path, tmp_path: Path, name: str, signature: bytes) -> None:
    assert main([str(trace_path), "--out", str(tmp_path / name)]) == 0
    assert (tmp_path / name).read_bytes().startswith(signature)
    assert list(tmp_path.iterdir()) == [tmp_path / name]


def test_what_cannot_be_drawn_is_one_line_and_status_2(
    trace_path: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    TraceWriter(tmp_path / "empty.csv", 1000).close()
    for arguments in (
        [str(tmp_path / "none.csv"), "--out", str(tmp_path / "run.png")],
        [str(tmp_path / "empty.csv"), "--out", str(tmp_path / "run.png")],
        [str(trace_path), "--out", str(tmp_path / "run.unknown")],
        [str(trace_path), "--out", str(tmp_path / "none" / "run.png")],
    ):
        assert main(arguments) == 2
        assert capsys.readouterr().err.count("\n") == 1
