"""The estimation problem of a recording: readings, model and prior."""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from emulator.config.table_config import TableConfig
from tools.emulated import Array
from tools.identification.likelihood import Intervals
from tools.identification.parameters import PARAMETERS, with_logarithms
from tools.identification.posterior import Posterior
from tools.identification.recording import DriveRecording, WireRecording
from tools.identification.simulation import (
    Standstill,
    commanded_motions,
    drive_positions_deg,
    from_rest,
    ticks_of,
    wire_positions_deg,
)
from tools.identification.timing import Timing, timing

_WIRE_DELAY_S = (0.0, 5e-6)
"""Mean and deviation: commands and readings both take effect at the end of a tick, so there is no delay between them.

A free delay would absorb model errors together with some of the gain.
"""

_OFFSET_DEG = (0.0, 0.02)
"""Mean and deviation of the drift's knots."""

_ENCODER_PHASE, _GAP_SHARE = (0.5, 0.3), (0.0, 0.6)
"""Mean and deviation of the table's rest position before the first command, as wide as the range."""

_DRIFT_KNOT_S = 6.0
"""Length of a straight piece of the drift.

The encoder's distance from the reference drifts: at each change of the gain set the PID keeps its output, and so loses
a little of that distance."""

_DRIVE_DELAY_TICKS = (1.0, 1.0)
"""Mean and deviation: a new duty waits for a tick in the PWM's buffer."""

_DRIVE_WINDOW_S = 0.008

_WIDEST_GAP_DEG = 1.5
"""A drive's readings count after this travel: before it, the position of the teeth in the gap is unknown."""


class Prior(NamedTuple):
    """The prior of each component of the vector: mean and standard deviation."""

    mean: Array
    deviation: Array


class Problem(NamedTuple):
    """The compared readings, and the posterior in the prior's standard units."""

    time_s: Array
    seen_deg: Array
    prior: Prior
    posterior: Posterior


def problem_of(config: TableConfig, recording: WireRecording | DriveRecording) -> Problem:
    """Return the problem of a recording of either kind."""
    if isinstance(recording, WireRecording):
        return _wire_problem(config, recording)
    return _drive_problem(config, recording)


def _problem(
    time_s: Array, seen_deg: Array, prior: Prior, readings: Intervals, predict: Callable[[Array], Array], drift: Array
) -> Problem:
    """Return a problem in standard units; the last components of the prior are the drift's."""
    size = len(prior.mean) - drift.shape[1]
    mean, deviation = prior.mean[:size], prior.deviation[:size]
    posterior = Posterior(
        readings, lambda vector: predict(mean + deviation * vector), drift * prior.deviation[size:], size
    )
    return Problem(time_s, seen_deg, prior, posterior)


def _prior(config: TableConfig, *others: tuple[float, float]) -> Prior:
    """Return means and deviations of the configured constants, and of the additional components."""
    constants = [(parameter.log_of(config), parameter.spread) for parameter in PARAMETERS]
    return Prior(*np.array([*constants, *others]).T)


def _wire_problem(config: TableConfig, recording: WireRecording) -> Problem:
    at, tick_hz = timing(config, recording), config.control.tick_hz
    motions = commanded_motions(config, recording, at.commands)
    kept = _trusted(config, recording, at, motions)
    time_s, ticks = recording.time_s[kept], at.readings[kept]
    seen_deg = (recording.position_deg - recording.position_deg[0])[kept]
    drift = _drift(time_s)

    def predict(constants: Array) -> Array:
        *logarithms, delay_s, encoder_phase, gap_share = constants
        start = Standstill(encoder_phase, gap_share)
        return wire_positions_deg(with_logarithms(config, logarithms), motions, ticks - delay_s * tick_hz, start)

    prior = _prior(config, _WIRE_DELAY_S, _ENCODER_PHASE, _GAP_SHARE, *[_OFFSET_DEG] * drift.shape[1])
    return _problem(time_s, seen_deg, prior, _intervals(config, recording, seen_deg), predict, drift)


def _intervals(config: TableConfig, recording: WireRecording, seen_deg: Array) -> Intervals:
    """Return the information of replies: a reply is a rounded count, so the encoder was between two counts."""
    count_deg, half = config.counts_per_deg, recording.resolution_deg / 2.0
    low = np.ceil((seen_deg - half) * count_deg - 1e-6) / count_deg
    high = (np.floor((seen_deg + half) * count_deg + 1e-6) + 1.0) / count_deg
    return Intervals(low, high)


def _trusted(
    config: TableConfig, recording: WireRecording, at: Timing, motions: NDArray[np.int64]
) -> NDArray[np.bool_]:
    """Return which readings are reliable: by their times, and by the start of the table from its last rest."""
    doubtful = at.doubtful_commands[[sent.verb in "PR" for sent in recording.commands]]
    sets_off = from_rest(config, motions)
    last = np.searchsorted(motions[sets_off, 0], at.readings, side="right") - 1
    astray = (last >= 0) & doubtful[sets_off][last]
    return ~(at.doubtful_readings | astray)


def _drift(time_s: Array) -> Array:
    """Return the hat functions (readings, knots) of a piecewise straight line."""
    knots = np.linspace(time_s[0], time_s[-1], max(2, 1 + round((time_s[-1] - time_s[0]) / _DRIFT_KNOT_S)))
    return np.array([np.interp(time_s, knots, hat) for hat in np.eye(len(knots))]).T


def _drive_problem(config: TableConfig, recording: DriveRecording) -> Problem:
    """Compare the travel in each short window: positions would drift apart without a control loop."""
    tick_hz = config.control.tick_hz
    duty, position_deg = ticks_of(recording, tick_hz)
    window = max(1, round(_DRIVE_WINDOW_S * tick_hz))
    first = int(np.argmax(np.abs(position_deg[::window] - position_deg[0]) > _WIDEST_GAP_DEG))
    seen_deg = np.diff(position_deg[::window])[first:]
    count_deg = 1.0 / config.counts_per_deg

    def predict(vector: Array) -> Array:
        *logarithms, delay_ticks = vector
        positions = drive_positions_deg(with_logarithms(config, logarithms), duty, max(delay_ticks, 0.0))
        made: Array = np.diff(positions[::window])[first:]
        return made

    prior = _prior(config, _DRIVE_DELAY_TICKS)
    time_s = (first + np.arange(1, len(seen_deg) + 1)) * window / tick_hz
    readings, no_drift = Intervals(seen_deg - count_deg, seen_deg + count_deg), np.empty((len(seen_deg), 0))
    return _problem(time_s, seen_deg, prior, readings, predict, no_drift)
