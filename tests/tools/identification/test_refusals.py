"""Recordings that must be refused, from the command line."""

from collections.abc import Callable
from dataclasses import replace
from math import ceil
from pathlib import Path

import numpy as np
import pytest
import serial

from emulator.config.table_config import TableConfig
from emulator.protocol_emulator import Serial
from protocol.client import TableClient
from tests.tools.identification.late_port import LatePort
from tools.emulated import Array
from tools.identification.errors import RecordingError
from tools.identification.excitation import excitation
from tools.identification.recorder import record
from tools.identification.recording import WireRecording, write_recording
from tools.identification.recording_checks import check_line
from tools.identify import main

Clock = Callable[[Array], Array]


def on_clock(recording: WireRecording, clock: Clock, lines_too: bool = True) -> WireRecording:
    """Return a recording on another clock; the replies alone, if the lines' times are not on it."""

    def at(time_s: float, moved: bool = True) -> float:
        return float(clock(np.array(time_s))) if moved else time_s

    return recording._replace(
        commands=tuple(
            sent._replace(time_s=at(sent.time_s, lines_too), reply_s=at(sent.reply_s)) for sent in recording.commands
        ),
        time_s=clock(recording.time_s) if lines_too else recording.time_s,
        reply_s=clock(recording.reply_s),
    )


def jumping(by_s: float, at_s: float) -> Clock:
    return lambda time_s: time_s + np.where(time_s > at_s, by_s, 0.0)


def gathered(period_s: float) -> Clock:
    return lambda time_s: np.ceil(time_s / period_s - 1e-9) * period_s


def doubled(recording: WireRecording) -> WireRecording:
    """Each reading once more, a little later: two programs logged the same line."""
    return recording._replace(
        time_s=np.repeat(recording.time_s, 2) + np.tile([0.0, 1e-4], len(recording.time_s)),
        position_deg=np.repeat(recording.position_deg, 2),
        reply_s=np.repeat(recording.reply_s, 2) + np.tile([0.0, 1e-4], len(recording.time_s)),
    )


def without_a_move(recording: WireRecording) -> WireRecording:
    """The first P is missing."""
    first = next(index for index, sent in enumerate(recording.commands) if sent.verb == "P")
    return recording._replace(commands=recording.commands[:first] + recording.commands[first + 1 :])


@pytest.mark.parametrize(
    ("spoil", "reason"),
    [
        (lambda recording: on_clock(recording, jumping(0.0203, 30.0)), "clock jumps or runs unevenly"),
        (lambda recording: on_clock(recording, jumping(-0.02, 30.0)), "was sent before the reply"),
        (lambda recording: on_clock(recording, lambda time_s: np.round(time_s, 2)), "on a grid of 10 ticks"),
        (lambda recording: on_clock(recording, gathered(0.016), lines_too=False), "on a grid of 16 ticks"),
        (lambda recording: on_clock(recording, gathered(0.002), lines_too=False), "on a grid of 2 ticks"),
        (doubled, "readings are doubled"),
        (without_a_move, "moves without a command: a P or R command is missing"),
        # An integer number of ticks leaves no trace in the replies' phase: the fit must find it.
        (lambda recording: on_clock(recording, jumping(0.02, 32.0)), "the model does not explain the recording"),
    ],
)
def test_a_spoiled_recording_is_refused_with_its_reason(
    spoil: Callable[[WireRecording], WireRecording],
    reason: str,
    recording: WireRecording,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    trace, out = tmp_path / "trace.csv", tmp_path / "table.toml"
    write_recording(trace, spoil(recording))

    status = main(["fit", str(trace), "--out", str(out)])

    message = capsys.readouterr().err
    assert status == 2
    assert reason in message
    assert list(tmp_path.iterdir()) == [trace]


class GatheringPort(LatePort):
    """An adapter in virtual time that delivers received bytes every 16 ms."""

    def __init__(self, port: Serial, ticks: int) -> None:
        super().__init__(port)
        self._ticks = ticks

    def dawdle(self) -> None:
        tick = round(1000.0 * self.clock.now_s())
        self.port.advance(ceil(tick / self._ticks) * self._ticks - tick)


def test_recording_over_an_adapter_that_gathers_bytes_ends_after_the_first_burst(assumed: TableConfig) -> None:
    port = serial.serial_for_url("emulator://?seed=1", baudrate=9600)
    assert isinstance(port, Serial)
    client = TableClient(GatheringPort(port, 16))
    lengths: list[float] = []

    def check(so_far: WireRecording) -> None:
        lengths.append(float(so_far.time_s[-1]))
        check_line(assumed, so_far)

    with client, pytest.raises(RecordingError, match="on a grid of 16 ticks"):
        record(client, excitation(60.0, 40.0, 100.0, seed=0), speed_deg_s=40.0, baud=9600, check=check)

    assert len(lengths) == 1
    assert lengths[0] < 8.0


def test_a_computer_that_is_late_too_often_is_named(assumed: TableConfig, recording: WireRecording) -> None:
    late_s = np.where(np.arange(len(recording.time_s)) % 5 < 2, 4e-3, 0.0)

    check_line(assumed, recording)
    with pytest.raises(RecordingError, match=r"40 % of the replies come late \(allowed 30 %\)"):
        check_line(assumed, recording._replace(reply_s=recording.reply_s + late_s))


def test_another_tick_is_named(assumed: TableConfig, recording: WireRecording) -> None:
    other = replace(assumed, control=replace(assumed.control, tick_hz=1500))

    with pytest.raises(RecordingError, match=r"control\.tick_hz"):
        check_line(other, recording)
