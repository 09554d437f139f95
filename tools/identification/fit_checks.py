"""Whether a fit is to be believed: the model must explain the readings, and the motor should be the configured one."""

from math import log, pi, sqrt

import numpy as np

from emulator.config.table_config import TableConfig
from tools.identification.constants import DERIVED, Derived, log_slope
from tools.identification.errors import RecordingError
from tools.identification.identify_table import Identified
from tools.identification.parameters import PARAMETERS, with_logarithms

MOST_UNEXPLAINED_DEG = 2e-3
"""The root mean square beyond rounding that a good recording stays below."""

_STRIPES = 30
_WHOLE = 0.5
"""Errors in at least this share of the recording are said to be everywhere."""

_COMPARED = ("gain", "time constant", "Coulomb friction as duty", "backlash")
_MOST_APART = 2.5
"""By how many standard deviations the halves may differ. Steady tables stay below 1, since the deviations include the
model error."""

_AT_ODDS = log(1.25)
"""A torque constant differs from its datasheet by a tenth; by a quarter it is another motor."""


def check_fit(found: Identified) -> None:
    """Refuse a fit that does not explain its recording.

    Raises:
        RecordingError: What is left unexplained is more than rounding, or the halves of the recording disagree.
    """
    _check_residual(found)
    for name, unit, function in DERIVED:
        if name in _COMPARED:
            _check_halves(found, name, unit, function)


def _check_halves(found: Identified, name: str, unit: str, function: Derived) -> None:
    values, variances = [], []
    for half in found.estimate.halves:
        logarithms = half.vector[: len(PARAMETERS)]
        slope = np.zeros(len(half.vector))
        slope[: len(PARAMETERS)] = log_slope(found.config, logarithms, function)
        values.append(function(with_logarithms(found.config, logarithms)))
        variances.append(float(slope @ half.covariance @ slope))
    apart = abs(log(values[1] / values[0])) / sqrt(sum(variances))
    if apart > _MOST_APART:
        raise RecordingError(
            f"the halves of the recording disagree: {name} {values[0]:.4g} in the first, {values[1]:.4g} {unit} in the "
            f"second, {apart:.1f} standard deviations apart (allowed {_MOST_APART:g}): load, friction, table or clock "
            "changed, or gains, gears or encoder differ from --config"
        )


def _check_residual(found: Identified) -> None:
    left = found.unexplained_deg
    rms_deg = float(np.sqrt(np.mean(left**2)))
    if rms_deg <= MOST_UNEXPLAINED_DEG:
        return
    raise RecordingError(
        f"the model does not explain the recording: beyond rounding {rms_deg:.2g} deg rms are left "
        f"(allowed {MOST_UNEXPLAINED_DEG:g}), {_where(found)}; a step or drift of the clock, a changed load or table, "
        "a table that was turned by hand, an encoder that lost counts, or other gains, gears or encoder than configured"
    )


def _where(found: Identified) -> str:
    """Return where the recording differs most from the model."""
    time_s = found.time_s
    edges = np.linspace(time_s[0], time_s[-1], _STRIPES + 1)
    stripe = np.clip(np.searchsorted(edges, time_s, side="right") - 1, 0, _STRIPES - 1)
    power = np.bincount(stripe, found.unexplained_deg**2, _STRIPES)
    bad = np.flatnonzero(power > power.max() / 10.0)
    if len(bad) > _WHOLE * _STRIPES:
        return "all over it"
    return f"most of them from {edges[bad[0]]:.0f} to {edges[bad[-1] + 1]:.0f} s"


def motor_at_odds(found: Identified, assumed: TableConfig) -> str:
    """Return in a sentence how the motor found differs from the configured one, or nothing if it does not."""
    before, after = assumed.motor.torque_constant_Nm_A, found.config.motor.torque_constant_Nm_A
    if abs(log(after / before)) <= _AT_ODDS:
        return ""
    no_load = [assumed.driver.supply_V / constant * 30.0 / pi for constant in (after, before)]
    return (
        f"the motor's torque constant comes out as {1e3 * after:.3g} mNm/A (no-load speed {no_load[0]:.0f} rpm), but "
        f"{1e3 * before:.3g} mNm/A ({no_load[1]:.0f} rpm) is configured; check motor, supply, gear ratio, encoder and "
        "gains in --config: torques and inertias are wrong if one of them is"
    )
