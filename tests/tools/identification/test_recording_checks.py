from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray

from emulator.config.table_config import TableConfig
from tools.emulated import Array
from tools.identification.errors import RecordingError
from tools.identification.recording import DriveRecording, Sent, WireRecording
from tools.identification.recording_checks import check_recording

Spoil = Callable[[WireRecording], WireRecording]


def kept(recording: WireRecording, which: NDArray[np.bool_]) -> WireRecording:
    return recording._replace(
        time_s=recording.time_s[which],
        position_deg=recording.position_deg[which],
        reply_s=recording.reply_s[which],
    )


def later(recording: WireRecording, shift_s: Array) -> WireRecording:
    """Shift the recorder's clock by a given time at each reading, including the commands."""

    def shifted(sent: Sent) -> Sent:
        by_s = float(np.interp(sent.time_s, recording.time_s, shift_s))
        return sent._replace(time_s=sent.time_s + by_s, reply_s=sent.reply_s + by_s)

    return recording._replace(
        time_s=recording.time_s + shift_s,
        reply_s=recording.reply_s + shift_s,
        commands=tuple(map(shifted, recording.commands)),
    )


def too_short(recording: WireRecording) -> WireRecording:
    return kept(recording, np.arange(len(recording.time_s)) < 500)


def with_a_gap(recording: WireRecording) -> WireRecording:
    return kept(recording, (recording.time_s < 20.0) | (recording.time_s > 21.0))


def with_the_clock_set_back(recording: WireRecording) -> WireRecording:
    return later(recording, np.where(recording.time_s > 20.0, -0.3, 0.0))


def with_the_clock_set_forward(recording: WireRecording) -> WireRecording:
    return later(recording, np.where(recording.time_s > 30.0, 0.0203, 0.0))


def with_a_timer_of(period_s: float) -> Spoil:
    def spoil(recording: WireRecording) -> WireRecording:
        """Deliver everything at the next tick of an adapter, and send nothing earlier."""

        def gathered(time_s: Array) -> Array:
            return np.ceil(time_s / period_s) * period_s

        return recording._replace(
            reply_s=gathered(recording.reply_s),
            commands=tuple(
                sent._replace(reply_s=float(gathered(np.array(sent.reply_s)))) for sent in recording.commands
            ),
        )

    return spoil


def with_replies_that_an_adapter_gathers(recording: WireRecording) -> WireRecording:
    late_s = np.random.default_rng(1).uniform(0.0, 3e-3, len(recording.time_s))
    return recording._replace(reply_s=recording.reply_s + late_s)


def in_radians(recording: WireRecording) -> WireRecording:
    return recording._replace(position_deg=np.radians(recording.position_deg))


def in_milliseconds(recording: WireRecording) -> WireRecording:
    return recording._replace(time_s=1000.0 * recording.time_s)


def in_counts(recording: WireRecording) -> WireRecording:
    return recording._replace(position_deg=512.0 * recording.position_deg)


def stalled(recording: WireRecording) -> WireRecording:
    position = recording.position_deg.copy()
    held = recording.time_s > 1.0
    position[held] = position[np.argmax(held)]
    return recording._replace(position_deg=position)


def without_motion(recording: WireRecording) -> WireRecording:
    return recording._replace(position_deg=0.0 * recording.position_deg)


def without_a_move(recording: WireRecording) -> WireRecording:
    """A P in the middle of a burst is missing; the table swings a little less far there."""
    moves = [index for index, sent in enumerate(recording.commands) if sent.verb == "P"]
    missing = moves[len(moves) // 3]
    return recording._replace(commands=recording.commands[:missing] + recording.commands[missing + 1 :])


def with_a_wrong_time(recording: WireRecording) -> WireRecording:
    last = recording.commands[-1]
    return recording._replace(commands=(*recording.commands[:-1], last._replace(time_s=1e9, reply_s=1e9 + 0.01)))


def without_commands(recording: WireRecording) -> WireRecording:
    return recording._replace(commands=())


def test_a_good_recording_passes(assumed: TableConfig, recording: WireRecording) -> None:
    check_recording(assumed, recording)


@pytest.mark.parametrize(
    ("spoil", "complaint"),
    [
        (too_short, r"500 readings in .* s; required are"),
        (with_a_gap, r"a gap of 1\.\d\d s at (19\.9|20\.0)"),
        (with_the_clock_set_back, r"the clock steps back by 0\.2\d* s at (19\.9|20\.0)"),
        (with_the_clock_set_forward, r"clock jumps or runs unevenly \(ticks [23]\d{4} to 3\d{4}\)"),
        (with_a_timer_of(0.002), "on a grid of 2 ticks"),
        (with_a_timer_of(0.016), "on a grid of 16 ticks"),
        (with_replies_that_an_adapter_gathers, "do not come at the table's ticks"),
        (in_radians, r"moves over [0-9.]+ deg only|not at the position of its commands"),
        (in_milliseconds, "check that its times are in seconds"),
        (in_counts, "the wrong units"),
        (stalled, "a stall"),
        (without_motion, "moves over 0 deg only"),
        (without_commands, "no P or R command"),
        (without_a_move, "a missing or changed command"),
        (with_a_wrong_time, "a command at 1e[+]09 s is .* away from the readings"),
    ],
)
def test_a_useless_recording_is_refused(
    spoil: Spoil, complaint: str, assumed: TableConfig, recording: WireRecording
) -> None:
    with pytest.raises(RecordingError, match=complaint):
        check_recording(assumed, spoil(recording))


@pytest.mark.parametrize(
    ("duty_scale", "moves", "complaint"),
    [(100.0, True, "must be within -1..1"), (0.9, False, "driven hard but stands still")],
)
def test_a_drive_that_cannot_be_understood_is_refused(
    duty_scale: float, moves: bool, complaint: str, assumed: TableConfig
) -> None:
    time_s = np.arange(0.0, 12.0, 0.001)
    duty = duty_scale * np.sign(np.sin(2.0 * np.pi * 0.25 * time_s))
    position = 20.0 * np.sin(2.0 * np.pi * 0.25 * time_s)
    if not moves:
        position[3000:] = position[3000]

    with pytest.raises(RecordingError, match=complaint):
        check_recording(assumed, DriveRecording(time_s, duty, position))


def test_a_drive_that_never_reverses_is_refused(assumed: TableConfig) -> None:
    time_s = np.arange(0.0, 12.0, 0.001)

    with pytest.raises(RecordingError, match="never changes its sign"):
        check_recording(assumed, DriveRecording(time_s, np.full(12_000, 0.3), 18.0 * time_s))
