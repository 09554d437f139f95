"""Check whether a recording can be used. Each message is one line with the problem, its place, and the requirement."""

import numpy as np

from emulator.config.table_config import TableConfig
from tools.emulated import Array
from tools.identification.errors import RecordingError
from tools.identification.recording import BITS_A_BYTE, DriveRecording, WireRecording
from tools.identification.simulation import commanded_motions, ticks_of, wire_positions_deg
from tools.identification.timing import timing

LEAST_DURATION_S, LONGEST_DURATION_S = 10.0, 3600.0
LEAST_READINGS = 300
LONGEST_GAP_S = 0.5
_LEAST_TRAVEL_DEG = 5.0
_STALL_S = 1.0
_OBEYED_DEG = 0.3
_STRAY_DEG = 0.6
"""Maximum deviation of a table from one with the assumed constants. Without a fault, it is at most 0.25."""
_AS_FAR = (0.9, 1.1)
"""Shares of the predicted travel that do not indicate wrong units."""
_UNSENT_S, _AT_REST_DEG = 0.3, 0.2
"""Time and range in which the prediction rests when the table moves without a command."""
_MOST_LATE = 0.3
_SHORTEST_REPLY = len("OK\r")
_OVERLAP_S = 1e-3


def check_recording(config: TableConfig, recording: WireRecording | DriveRecording) -> None:
    """Refuse a recording that does not identify the table's constants.

    Raises:
        RecordingError: it is too short, has gaps, clock steps, a stall or the wrong units, or moves too little.
    """
    _check_times(recording.time_s)
    _check_speeds(config, recording.time_s, recording.position_deg)
    if isinstance(recording, WireRecording):
        _check_span(recording)
        _check_against_commands(config, recording)
    else:
        _check_duty(config, recording)


def check_line(config: TableConfig, recording: WireRecording) -> None:
    """Refuse a recording in progress if the line or the recording computer delays too much.

    Raises:
        RecordingError: the replies do not determine the table's ticks, or too many are late.
    """
    at = timing(config, recording)
    if at.fault:
        raise RecordingError(at.fault)
    late = float(np.mean(at.doubtful_readings))
    if late > _MOST_LATE:
        raise RecordingError(
            f"{100.0 * late:.0f} % of the replies come late (allowed {100.0 * _MOST_LATE:.0f} %): the computer is "
            "busy, or the line delays replies"
        )


def _check_times(time_s: Array) -> None:
    duration_s = float(time_s[-1] - time_s[0]) if len(time_s) else 0.0
    if duration_s > LONGEST_DURATION_S:
        raise RecordingError(f"the recording lasts {duration_s:.0f} s; check that its times are in seconds")
    if duration_s < LEAST_DURATION_S or len(time_s) < LEAST_READINGS:
        raise RecordingError(
            f"the recording has {len(time_s)} readings in {duration_s:.1f} s; "
            f"required are {LEAST_READINGS} in {LEAST_DURATION_S:g} s"
        )
    steps = np.diff(time_s)
    if steps.min() < 0.0:
        at = int(np.argmin(steps))
        raise RecordingError(f"the clock steps back by {-steps[at]:.3f} s at {time_s[at]:.3f} s")


def _check_span(recording: WireRecording) -> None:
    """Refuse commands far from the readings, because the simulation would run up to them."""
    times = [sent.time_s for sent in recording.commands]
    for time_s in (min(times, default=0.0), max(times, default=0.0)):
        away_s = max(recording.time_s[0] - time_s, time_s - recording.time_s[-1])
        if times and away_s > LONGEST_DURATION_S:
            raise RecordingError(
                f"a command at {time_s:.6g} s is {away_s:.3g} s away from the readings; check its time"
            )


def _check_gaps(time_s: Array) -> None:
    steps = np.diff(time_s)
    if steps.max() > LONGEST_GAP_S:
        at = int(np.argmax(steps))
        raise RecordingError(
            f"the recording has a gap of {steps[at]:.2f} s at {time_s[at]:.2f} s; "
            f"the longest allowed is {LONGEST_GAP_S:g} s"
        )


def _check_speeds(config: TableConfig, time_s: Array, position_deg: Array) -> None:
    """Find a step of the clock, or of the position, by a speed that no such table has."""
    travel_deg = float(np.ptp(position_deg))
    if travel_deg < _LEAST_TRAVEL_DEG:
        raise RecordingError(
            f"the table moves over {travel_deg:.3g} deg only; required are {_LEAST_TRAVEL_DEG:g} "
            "(check that it turns, and that the positions are in degrees)"
        )
    most_deg_s = 2.0 * config.limits.speed_deg_s
    reach_s = 0.1
    before = np.searchsorted(time_s, time_s - reach_s)
    way_deg = np.abs(position_deg - position_deg[before])
    excess_deg = way_deg - most_deg_s * (time_s - time_s[before]) - 0.5
    if excess_deg.max() > 0.0:
        at = int(np.argmax(excess_deg))
        raise RecordingError(
            f"at {time_s[at]:.3f} s the position changes by {way_deg[at]:.3g} deg within "
            f"{time_s[at] - time_s[before][at]:.3f} s: a step of the clock, lost readings, or the wrong units"
        )


def _check_against_commands(config: TableConfig, recording: WireRecording) -> None:
    if not any(sent.verb in "PR" for sent in recording.commands):
        raise RecordingError(
            "the recording has no P or R command; the duty follows from the commands, so they are required"
        )
    at = timing(config, recording)
    if at.fault:
        raise RecordingError(at.fault)
    _check_dialogue(config, recording)
    _check_gaps(recording.time_s)
    predicted = wire_positions_deg(config, commanded_motions(config, recording, at.commands), at.readings)
    seen = recording.position_deg - recording.position_deg[0]
    faults = [_stall(recording.time_s, seen, predicted), _stray(recording.time_s, seen, predicted)]
    found = sorted(fault for fault in faults if fault)
    if found:
        raise RecordingError(found[0][1])


def _check_dialogue(config: TableConfig, recording: WireRecording) -> None:
    """Refuse lines that were sent before the previous reply was complete: no client of the table does that."""
    sent = np.concatenate([recording.time_s, [sent.time_s for sent in recording.commands]])
    replied = np.concatenate([recording.reply_s, [sent.reply_s for sent in recording.commands]])
    order = np.argsort(sent, kind="stable")
    sent, replied = sent[order], replied[order]
    if not np.isfinite(replied).all():
        baud = config.serial.baud
        replied = sent + (_SHORTEST_REPLY * BITS_A_BYTE / baud if baud else 0.0)
    early_s = replied[:-1] - sent[1:]
    if early_s.max() > _OVERLAP_S or (np.diff(sent) <= 0.0).any():
        at = int(np.argmax(np.where(np.diff(sent) <= 0.0, np.inf, early_s)))
        raise RecordingError(
            f"the line at {sent[at + 1]:.3f} s was sent before the reply to the line at {sent[at]:.3f} s was complete: "
            "readings are doubled, rows are mixed up, the clock was set back, or serial.baud differs"
        )
    if (replied < sent).any():
        raise RecordingError(
            f"the reply to the line at {sent[np.argmax(replied < sent)]:.3f} s came before it: the columns are mixed up"
        )


_Fault = tuple[float, str]
"""The start of a deviation, and its kind."""


def _stall(time_s: Array, seen_deg: Array, predicted_deg: Array) -> _Fault | None:
    before = np.searchsorted(time_s, time_s - _STALL_S)
    changes = np.cumsum(np.abs(np.diff(seen_deg, prepend=seen_deg[0])) > 1e-9)
    stands = changes == changes[before]
    should_move = np.abs(predicted_deg - predicted_deg[before]) > 1.0
    obeyed = np.abs(seen_deg - predicted_deg)[before] < _OBEYED_DEG
    stalled = stands & should_move & obeyed & (time_s - time_s[0] > _STALL_S)
    if not stalled.any():
        return None
    at = float(time_s[np.argmax(stalled)])
    return (
        at - _STALL_S,
        f"the table stands still for {_STALL_S:g} s before {at:.2f} s although it had a command: a stall",
    )


def _stray(time_s: Array, seen_deg: Array, predicted_deg: Array) -> _Fault | None:
    stray = np.abs(seen_deg - predicted_deg) > _STRAY_DEG
    if not stray.any():
        return None
    first = int(np.argmax(stray))
    at, begin = float(time_s[first]), int(np.searchsorted(time_s, time_s[first] - _UNSENT_S))
    ratio = float(np.ptp(seen_deg) / max(np.ptp(predicted_deg), 1e-9))
    if np.ptp(predicted_deg[begin : first + 1]) < _AT_REST_DEG:
        reason = (
            "it moves without a command: a P or R command is missing, the clock was set, readings are mixed "
            "up, or the table was turned by hand"
        )
    elif _AS_FAR[0] < ratio < _AS_FAR[1]:
        reason = (
            f"it is up to {np.abs(seen_deg - predicted_deg).max():.2g} deg away: a missing or changed command, a step "
            "of the clock, mixed-up rows, a sign; or motion too fast for the table (record with a lower --speed)"
        )
    else:
        reason = (
            f"it travels {ratio:.3g} times as far: wrong units, a step of the clock, a missing command, "
            "or other gears and encoder than configured"
        )
    return at, f"from {at:.2f} s on the table is not at the position of its commands; {reason}"


def _check_duty(config: TableConfig, recording: DriveRecording) -> None:
    if np.abs(recording.duty).max() > 1.0:
        raise RecordingError(
            f"the duty reaches {np.abs(recording.duty).max():.4g}; it must be within -1..1 (not percent or volts)"
        )
    duty, position_deg = ticks_of(recording, config.control.tick_hz)
    driven = np.abs(duty) > config.protection.stall_duty
    window = round(config.protection.stall_time_s * config.control.tick_hz)
    starts = np.flatnonzero(np.abs(position_deg[window:] - position_deg[:-window]) < 1e-9)
    hard_so_far = np.concatenate([[0], np.cumsum(driven)])
    stalls = starts[hard_so_far[starts + window] - hard_so_far[starts] == window]
    if len(stalls):
        at_s = stalls[0] / config.control.tick_hz
        raise RecordingError(f"the motor is driven hard but stands still at {at_s:.2f} s: a stall")
    if np.abs(np.diff(np.sign(duty[duty != 0.0]))).sum() == 0.0:
        raise RecordingError(
            "the duty never changes its sign; without reversals neither friction nor backlash is identifiable"
        )
