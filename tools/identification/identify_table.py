"""From a recording to a table's constants with their confidence intervals."""

from collections.abc import Callable
from math import exp, log
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from emulator.config import TableConfig
from tools.emulated import Array
from tools.identification.estimation import Estimate, Posterior, Prior, estimate
from tools.identification.likelihood import Intervals
from tools.identification.parameters import BACKLASH, PARAMETERS, with_logarithms
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
from tools.tuning.linear_model import Teeth, load_ratio, speed_gain_deg_s, time_constant_s

_BACKLASH_STARTS_ARCMIN = (1.5, 3.0, 6.0, 12.0, 22.0, 36.0, 56.0)
_SURE_95 = 1.96
_TOLD_SHARE = 0.5
_TOLD_DEVIATION = 0.25
"""A constant is told by a recording that at least halves what was uncertain of it, and to a quarter of its value."""

_WIRE_DELAY_S = (0.0, 5e-6)
"""Mean and deviation: commands and readings are both carried out at the end of a tick, so that nothing is between them.
A delay that is free to fit what the model does not foretell takes some of the gain with it."""

_OFFSET_DEG = (0.0, 0.02)
"""Mean and deviation: how far from the reference the encoder may stand, without a duty that tells it."""

_ENCODER_PHASE, _GAP_SHARE = (0.5, 0.3), (0.0, 0.6)
"""How the table stands at first: mean and deviation, as wide as can be. Within a wide gap much depends on it."""

_DRIFT_KNOT_S = 6.0
"""The encoder's place behind the reference drifts: at each change of the gain set the regulator keeps its output, and
so forgets a little of how far it is behind. This long, straight pieces of the drift are told from the readings."""

_DRIVE_DELAY_TICKS = (1.0, 1.0)
"""Mean and deviation: a new duty waits for a tick in the PWM's buffer."""

_DRIVE_WINDOW_S = 0.008


class Constant(NamedTuple):
    """An estimated constant with its 95 % confidence interval, and whether the recording told it."""

    name: str
    unit: str
    value: float
    low: float
    high: float
    told: bool


class Identified(NamedTuple):
    """The outcome."""

    config: TableConfig
    constants: tuple[Constant, ...]
    estimate: Estimate
    time_s: Array  # of what was compared
    seen_deg: Array
    foretold_deg: Array
    unexplained_deg: Array  # how far the foretold angles are outside what the readings tell


_Derived = Callable[[TableConfig], float]


def coulomb_Nm(config: TableConfig) -> float:
    """Return the Coulomb friction of a driven table at the motor's shaft, its bearing's share with it."""
    return config.friction.coulomb_Nm + config.table.bearing_friction_Nm * load_ratio(config, Teeth.DRIVING)


def coulomb_duty(config: TableConfig) -> float:
    """Return the duty that the Coulomb friction takes."""
    motor = config.motor
    return coulomb_Nm(config) * motor.resistance_ohm / motor.torque_constant_Nm_A / config.driver.supply_V


DERIVED: tuple[tuple[str, str, _Derived], ...] = (
    ("gain", "deg/s at full duty", speed_gain_deg_s),
    ("time constant", "ms, loaded", lambda config: 1e3 * time_constant_s(config, Teeth.DRIVING)),
    ("time constant, free", "ms, within the backlash", lambda config: 1e3 * time_constant_s(config, Teeth.FREE)),
    ("Coulomb friction", "mNm at the motor, loaded", lambda config: 1e3 * coulomb_Nm(config)),
    ("Coulomb friction as duty", "%", lambda config: 100.0 * coulomb_duty(config)),
    ("stiction", "times the Coulomb friction", lambda config: config.friction.stiction_ratio),
    ("viscous friction", "uNm s", lambda config: 1e6 * config.friction.viscous_Nm_s),
    ("backlash", "arcmin", lambda config: config.gears.backlash_arcmin),
)


def identify(
    config: TableConfig,
    recording: WireRecording | DriveRecording,
    progress: Callable[[float], None] = lambda _: None,
) -> Identified:
    """Return the constants of the table that was recorded.

    Args:
        config: What is known beforehand: the controller and its gains, the encoder, the datasheet.
        recording: A recording that `recording_checks` let pass.
        progress: Called with the share that is done.
    """
    if isinstance(recording, WireRecording):
        time_s, seen_deg, posterior = _wire_problem(config, recording)
    else:
        time_s, seen_deg, posterior = _drive_problem(config, recording)
    starts = []
    for arcmin in _BACKLASH_STARTS_ARCMIN:
        start = posterior.prior.mean.copy()
        start[BACKLASH] = log(arcmin)
        starts.append(start)
    found = estimate(posterior, starts, progress)
    return Identified(
        with_logarithms(config, found.vector[: len(PARAMETERS)]),
        _constants(config, posterior, found, isinstance(recording, DriveRecording)),
        found,
        time_s,
        seen_deg,
        found.foretold_deg,
        posterior.readings.outside_deg(found.foretold_deg),
    )


def _prior(config: TableConfig, *others: tuple[float, float]) -> Prior:
    """Return means and deviations of the configured constants, and of what comes after them."""
    constants = [(parameter.log_of(config), parameter.spread) for parameter in PARAMETERS]
    return Prior(*np.array([*constants, *others]).T)


def _wire_problem(config: TableConfig, recording: WireRecording) -> tuple[Array, Array, Posterior]:
    at, tick_hz = timing(config, recording), config.control.tick_hz
    motions = commanded_motions(config, recording, at.commands)
    kept = _trusted(config, recording, at, motions)
    time_s, ticks = recording.time_s[kept], at.readings[kept]
    seen_deg = (recording.position_deg - recording.position_deg[0])[kept]
    drift = _drift(time_s)

    def foretell(constants: Array) -> Array:
        *logarithms, delay_s, encoder_phase, gap_share = constants
        start = Standstill(encoder_phase, gap_share)
        return wire_positions_deg(with_logarithms(config, logarithms), motions, ticks - delay_s * tick_hz, start)

    prior = _prior(config, _WIRE_DELAY_S, _ENCODER_PHASE, _GAP_SHARE, *[_OFFSET_DEG] * drift.shape[1])
    steps = np.array([*(parameter.step for parameter in PARAMETERS), 2e-4, 0.0, 0.0])
    return time_s, seen_deg, Posterior(_intervals(config, recording, seen_deg), foretell, drift, prior, steps)


def _intervals(config: TableConfig, recording: WireRecording, seen_deg: Array) -> Intervals:
    """Return what replies tell: a reply is a rounded count, so the encoder stood between two counts."""
    count_deg, half = config.counts_per_turn / 360.0, recording.resolution_deg / 2.0
    low = np.ceil((seen_deg - half) * count_deg - 1e-6) / count_deg
    high = (np.floor((seen_deg + half) * count_deg + 1e-6) + 1.0) / count_deg
    return Intervals(low, high)


def _trusted(
    config: TableConfig, recording: WireRecording, at: Timing, motions: NDArray[np.int64]
) -> NDArray[np.bool_]:
    """Tell which readings are to be trusted: their own times, and when the table set off from its last rest."""
    doubtful = at.doubtful_commands[[sent.verb in "PR" for sent in recording.commands]]
    sets_off = from_rest(config, motions)
    last = np.searchsorted(motions[sets_off, 0], at.readings, side="right") - 1
    astray = (last >= 0) & doubtful[sets_off][last]
    return ~(at.doubtful_readings | astray)


def _drift(time_s: Array) -> Array:
    """Return the hat functions (readings, knots) of a piecewise straight line."""
    knots = np.linspace(time_s[0], time_s[-1], max(2, 1 + round((time_s[-1] - time_s[0]) / _DRIFT_KNOT_S)))
    return np.array([np.interp(time_s, knots, hat) for hat in np.eye(len(knots))]).T


def _drive_problem(config: TableConfig, recording: DriveRecording) -> tuple[Array, Array, Posterior]:
    """Compare the way made in each short window: positions would drift apart without a loop that holds them."""
    tick_hz = config.control.tick_hz
    duty, position_deg = ticks_of(recording, tick_hz)
    window = max(1, round(_DRIVE_WINDOW_S * tick_hz))
    seen_deg = np.diff(position_deg[::window])
    count_deg = 360.0 / config.counts_per_turn

    def foretell(vector: Array) -> Array:
        *logarithms, delay_ticks = vector
        positions = drive_positions_deg(with_logarithms(config, logarithms), duty, max(delay_ticks, 0.0))
        made: Array = np.diff(positions[::window])
        return made

    prior = _prior(config, _DRIVE_DELAY_TICKS)
    steps = np.array([*(parameter.step for parameter in PARAMETERS), 0.1])
    time_s = np.arange(1, len(seen_deg) + 1) * window / tick_hz
    readings, no_drift = Intervals(seen_deg - count_deg, seen_deg + count_deg), np.empty((len(seen_deg), 0))
    return time_s, seen_deg, Posterior(readings, foretell, no_drift, prior, steps)


def _constants(config: TableConfig, posterior: Posterior, found: Estimate, from_drive: bool) -> tuple[Constant, ...]:
    """Return what follows from the estimate, by linear propagation of the covariance."""
    size = len(PARAMETERS)
    before = np.diag(posterior.prior.deviation**2.0)
    result = []
    for name, unit, function in DERIVED:
        slope = np.zeros(len(found.vector))
        slope[:size] = _log_slope(config, found.vector[:size], function)
        after, prior = (float(np.sqrt(slope @ spread @ slope)) for spread in (found.covariance, before))
        value = function(with_logarithms(config, found.vector[:size]))
        told = after < min(_TOLD_SHARE * prior, _TOLD_DEVIATION)
        factor = exp(min(_SURE_95 * after, 50.0))
        result.append(Constant(name, unit, value, value / factor, value * factor, told))
    deviation = float(np.sqrt(found.covariance[size, size]))
    delay, unit = found.vector[size], "ticks, duty to bridge" if from_drive else "ms, reading behind command"
    scale = 1.0 if from_drive else 1e3
    told = bool(deviation < _TOLD_SHARE * posterior.prior.deviation[size])
    spread = _SURE_95 * deviation
    result.append(Constant("delay", unit, scale * delay, scale * (delay - spread), scale * (delay + spread), told))
    return tuple(result)


def _log_slope(config: TableConfig, logarithms: Array, function: _Derived) -> Array:
    step = 1e-4
    slopes = []
    for index in range(len(logarithms)):
        shift = np.zeros_like(logarithms)
        shift[index] = step
        ends = [function(with_logarithms(config, logarithms + sign * shift)) for sign in (1.0, -1.0)]
        slopes.append((log(ends[0]) - log(ends[1])) / (2.0 * step))
    return np.array(slopes)
