from pathlib import Path

import numpy as np
import pytest

from emulator import Table, load_config
from emulator.trace import TraceWriter, read_trace
from tools import trace_figure
from tools.command_marks import commands_of
from tools.plot_trace import main
from tools.trace_figure import draw_trace
from tools.trace_signals import SIGNALS


def test_the_command_line_names_every_signal_of_the_panels() -> None:
    assert [name for panel in trace_figure._PANELS for name in panel.signals] == list(SIGNALS)  # noqa: SLF001  # the table


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
    drawn = [str(trace_path), "--out", str(tmp_path / "run.png")]
    for arguments in (
        [*drawn, "--from", "nan"],
        [*drawn, "--to", "inf"],
        [*drawn, "--from", "3", "--to", "3"],
        [*drawn, "--from", "5", "--to", "2"],
        [*drawn, "--from", "1000"],
        [*drawn, "--to", "-1"],
        [*drawn, "--signals", "speed"],
        [*drawn, "--signals", ","],
        [str(tmp_path / "none.csv"), "--out", str(tmp_path / "run.png")],
        [str(tmp_path / "empty.csv"), "--out", str(tmp_path / "run.png")],
        [str(trace_path), "--out", str(tmp_path / "run.unknown")],
        [str(trace_path), "--out", str(tmp_path / "none" / "run.png")],
    ):
        assert main(arguments) == 2
        assert capsys.readouterr().err.count("\n") == 1
        assert not (tmp_path / "run.png").exists()


def test_an_unknown_signal_is_named_with_the_nearest_one(trace_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main([str(trace_path), "--out", "run.png", "--signals", "duty,speed_deg"]) == 2
    assert capsys.readouterr().err == (
        f"plot_trace: 'speed_deg' is not a signal; allowed are {', '.join(SIGNALS)}; did you mean speed_deg_s?\n"
    )


def test_a_part_of_the_trace_and_of_its_signals_is_drawn(trace_path: Path) -> None:
    figure = draw_trace(read_trace(trace_path), from_s=1.0, to_s=4.0, signals=("true_deg", "duty"))

    assert [axes.get_ylabel() for axes in figure.axes] == ["position (deg)", "duty (%)"]
    assert [axes.get_xlim() for axes in figure.axes] == [(1.0, 4.0)] * 2
    for axes in figure.axes:
        (curve,) = (line for line in axes.lines if line.get_label() in {"true", "duty"})
        times = np.asarray(curve.get_xdata())
        assert times[0] <= 1.0 < times[1]
        assert times[-2] < 4.0 <= times[-1]


def test_a_part_in_which_nothing_changes_is_a_line(trace_path: Path) -> None:
    """The trace contains only the first and the last tick of a rest."""
    figure = draw_trace(read_trace(trace_path), from_s=0.1, to_s=0.4, signals=("encoder_deg",))

    (curve,) = (line for line in figure.axes[0].lines if line.get_label() == "encoder")
    assert np.asarray(curve.get_xdata())[0] < 0.1
    assert np.asarray(curve.get_xdata())[-1] > 0.4
