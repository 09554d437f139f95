"""Whether a recording can be used: each test says in one line what is wrong, where, and what is needed."""

import numpy as np

from emulator.config import TableConfig
from tools.emulated import Array
from tools.identification.recording import DriveRecording, RecordingError, WireRecording
from tools.identification.simulation import commanded_motions, ticks_of, wire_positions_deg
from tools.identification.timing import timing

LEAST_DURATION_S = 10.0
LEAST_READINGS = 300
LONGEST_GAP_S = 0.5
_LEAST_TRAVEL_DEG = 5.0
_STALL_S = 1.0
_STRAY_DEG = 3.0


def check_recording(config: TableConfig, recording: WireRecording | DriveRecording) -> None:
    """Refuse a recording that cannot tell the table's constants.

    Raises:
        RecordingError: It is too short, has gaps, clock steps, a stall or the wrong units, or moves too little.
    """
    _check_times(recording.time_s)
    _check_speeds(config, recording.time_s, recording.position_deg)
    if isinstance(recording, WireRecording):
        _check_against_commands(config, recording)
    else:
        _check_duty(config, recording)


def _check_times(time_s: Array) -> None:
    duration_s = float(time_s[-1] - time_s[0]) if len(time_s) else 0.0
    if duration_s > 3600.0:
        raise RecordingError(f"the recording lasts {duration_s:.0f} s; are its times in seconds?")
    if duration_s < LEAST_DURATION_S or len(time_s) < LEAST_READINGS:
        raise RecordingError(
            f"the recording has {len(time_s)} readings in {duration_s:.1f} s; "
            f"needed are {LEAST_READINGS} in {LEAST_DURATION_S:g} s"
        )
    steps = np.diff(time_s)
    if steps.min() < 0.0:
        at = int(np.argmin(steps))
        raise RecordingError(f"the clock steps back by {-steps[at]:.3f} s at {time_s[at]:.3f} s")


def _check_gaps(time_s: Array) -> None:
    steps = np.diff(time_s)
    if steps.max() > LONGEST_GAP_S:
        at = int(np.argmax(steps))
        raise RecordingError(
            f"the recording has a gap of {steps[at]:.2f} s at {time_s[at]:.2f} s; "
            f"the longest allowed is {LONGEST_GAP_S:g} s"
        )


def _check_speeds(config: TableConfig, time_s: Array, position_deg: Array) -> None:
    """Find a step of the clock, or of the position, by a speed that no table of this kind has."""
    travel_deg = float(np.ptp(position_deg))
    if travel_deg < _LEAST_TRAVEL_DEG:
        raise RecordingError(
            f"the table moves over {travel_deg:.3g} deg only; needed are {_LEAST_TRAVEL_DEG:g} "
            "(does it turn, and are the positions in degrees?)"
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
    _check_gaps(recording.time_s)
    if not any(sent.verb in "PR" for sent in recording.commands):
        raise RecordingError(
            "the recording has no P or R command; the duty follows from the commands, so they are needed"
        )
    at = timing(config, recording)
    foretold = wire_positions_deg(config, commanded_motions(config, recording, at.commands), at.readings)
    seen = recording.position_deg - recording.position_deg[0]
    _check_stall(recording.time_s, seen, foretold)
    ratio = float(np.ptp(seen) / max(np.ptp(foretold), 1e-9))
    stray = np.abs(seen - foretold)
    if stray.max() > _STRAY_DEG:
        first = int(np.argmax(stray > _STRAY_DEG))
        raise RecordingError(
            f"from {recording.time_s[first]:.2f} s on the table is not where its commands send it "
            f"(travel {ratio:.3g} times as far): wrong units, a step of the clock, lost commands, "
            "or other gears and encoder than configured"
        )
    if not at.exact:
        raise RecordingError(
            "the replies do not come at the table's ticks, so the times are not known well enough: something on the "
            "line gathers bytes (the latency timer of a USB adapter?), or control.tick_hz is another"
        )


def _check_stall(time_s: Array, seen_deg: Array, foretold_deg: Array) -> None:
    before = np.searchsorted(time_s, time_s - _STALL_S)
    stands = np.abs(seen_deg - seen_deg[before]) < 1e-9
    should_move = np.abs(foretold_deg - foretold_deg[before]) > 1.0
    stalled = stands & should_move & (time_s - time_s[0] > _STALL_S)
    if stalled.any():
        at = int(np.argmax(stalled))
        raise RecordingError(
            f"the table stands still for {_STALL_S:g} s before {time_s[at]:.2f} s though it was sent: a stall"
        )


def _check_duty(config: TableConfig, recording: DriveRecording) -> None:
    if np.abs(recording.duty).max() > 1.0:
        raise RecordingError(
            f"the duty reaches {np.abs(recording.duty).max():.4g}; it must be within -1..1 (percent, or volts?)"
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
            "the duty never changes its sign; without reversals neither friction nor backlash can be told"
        )
