"""Check the plausibility of a fit: the model must explain the readings, and the motor should be the configured one."""

from math import log, pi, sqrt
from typing import NamedTuple

import numpy as np

from emulator.config.table_config import TableConfig
from tools.identification.constants import DERIVED, Derived, log_slope
from tools.identification.errors import RecordingError
from tools.identification.identify_table import Identified
from tools.identification.parameters import PARAMETERS, with_logarithms

MOST_UNEXPLAINED_DEG = 1e-4
"""Maximum root mean square beyond rounding for a good recording; the largest of 23 tables is 5e-5."""

_STRIPES = 30
_WHOLE = 0.5
"""Errors in at least this share of the recording are reported as everywhere."""

MOST_APART = {"gain": 1.5, "time constant": 1.5, "Coulomb friction as duty": 2.0, "backlash": 2.0}
"""Maximum difference of the halves, in standard deviations.

The deviations include the model error. So the halves of steady tables generally differ by less than half of one
(largest of 23 tables: 1.0, 1.0, 1.1 and 1.5).
"""

_AT_ODDS = log(1.07)
"""A gear ratio with an error of a tenth gives a torque constant with an error of a tenth, and no other sign."""


class Halves(NamedTuple):
    """A constant from each half of the recording, and the difference of the two in standard deviations."""

    name: str
    unit: str
    first: float
    second: float
    apart: float
    allowed: float


def check_fit(found: Identified) -> None:
    """Refuse a fit that does not explain its recording.

    Raises:
        RecordingError: the unexplained part is more than rounding, or the halves of the recording disagree.
    """
    _check_residual(found)
    for half in halves_of(found):
        if half.apart > half.allowed:
            raise RecordingError(
                f"the halves of the recording disagree: {half.name} {half.first:.4g} in the first, {half.second:.4g} "
                f"{half.unit} in the second, {half.apart:.1f} standard deviations apart (allowed {half.allowed:g}): "
                "load, friction, table or clock changed, or gains, gears or encoder differ from --config"
            )


def halves_of(found: Identified) -> tuple[Halves, ...]:
    """Return the compared constants from each half of the recording."""
    return tuple(_halves(found, name, unit, function) for name, unit, function in DERIVED if name in MOST_APART)


def _halves(found: Identified, name: str, unit: str, function: Derived) -> Halves:
    values, variances = [], []
    for half in found.estimate.halves:
        logarithms = half.vector[: len(PARAMETERS)]
        slope = np.zeros(len(half.vector))
        slope[: len(PARAMETERS)] = log_slope(found.config, logarithms, function)
        values.append(function(with_logarithms(found.config, logarithms)))
        variances.append(float(slope @ half.covariance @ slope))
    apart = abs(log(values[1] / values[0])) / sqrt(sum(variances))
    return Halves(name, unit, values[0], values[1], apart, MOST_APART[name])


def unexplained_rms_deg(found: Identified) -> float:
    """Return the root mean square of the part that rounding does not explain."""
    return float(np.sqrt(np.mean(found.unexplained_deg**2)))


def _check_residual(found: Identified) -> None:
    rms_deg, count_deg = unexplained_rms_deg(found), 360.0 / found.config.counts_per_turn
    if rms_deg <= MOST_UNEXPLAINED_DEG:
        return
    raise RecordingError(
        f"the model does not explain the recording: beyond rounding {rms_deg:.2g} deg rms ({rms_deg / count_deg:.2g} "
        f"counts) are left (allowed {MOST_UNEXPLAINED_DEG:g} deg), {_where(found)}; possible causes: "
        "a step or drift of the clock, a changed load or table, a table that was turned by hand, an encoder that lost "
        "counts; other gains, gears or encoder than configured; a search with a wrong result; record again"
    )


def _where(found: Identified) -> str:
    """Return the place at which the recording differs most from the model."""
    time_s = found.time_s
    edges = np.linspace(time_s[0], time_s[-1], _STRIPES + 1)
    stripe = np.clip(np.searchsorted(edges, time_s, side="right") - 1, 0, _STRIPES - 1)
    power = np.bincount(stripe, found.unexplained_deg**2, _STRIPES)
    bad = np.flatnonzero(power > power.max() / 10.0)
    if len(bad) > _WHOLE * _STRIPES:
        return "all over it"
    return f"most of them from {edges[bad[0]]:.0f} to {edges[bad[-1] + 1]:.0f} s"


def motor_at_odds(found: Identified, assumed: TableConfig) -> str:
    """Return in a sentence how the estimated motor differs from the configured one, or an empty text."""
    before, after = assumed.motor.torque_constant_Nm_A, found.config.motor.torque_constant_Nm_A
    if abs(log(after / before)) <= _AT_ODDS:
        return ""
    no_load = [assumed.driver.supply_V / constant * 30.0 / pi for constant in (after, before)]
    return (
        f"the motor's torque constant comes out as {1e3 * after:.3g} mNm/A (no-load speed {no_load[0]:.0f} rpm), but "
        f"{1e3 * before:.3g} mNm/A ({no_load[1]:.0f} rpm) is configured; check motor, supply, gear ratio, encoder and "
        "gains in --config: torques and inertias are wrong if one of them is, all constants if gains or encoder are"
    )
