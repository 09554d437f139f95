"""From a recording to the constants of a table with their confidence intervals."""

from collections.abc import Callable
from math import log
from typing import NamedTuple

import numpy as np

from emulator.config.table_config import TableConfig
from tools.emulated import Array
from tools.identification.constants import Constant, constants_of
from tools.identification.estimation import Estimate, Half, estimate
from tools.identification.parameters import BACKLASH, PARAMETERS, with_logarithms
from tools.identification.problems import Prior, problem_of
from tools.identification.recording import DriveRecording, WireRecording

_BACKLASH_STARTS_ARCMIN = (2.0, 5.0, 11.0, 22.0, 45.0)


class Identified(NamedTuple):
    """The result."""

    config: TableConfig
    constants: tuple[Constant, ...]
    estimate: Estimate
    time_s: Array  # of what was compared
    seen_deg: Array
    predicted_deg: Array
    unexplained_deg: Array  # distance of the predicted angles from the intervals of the readings


def identify(
    config: TableConfig,
    recording: WireRecording | DriveRecording,
    progress: Callable[[float], None] = lambda _: None,
) -> Identified:
    """Return the constants of the recorded table.

    Args:
        config: known constants: the controller and its gains, the encoder, the datasheet.
        recording: a recording that passed `recording_checks`.
        progress: called with the finished share.
    """
    problem = problem_of(config, recording)
    mean, deviation = problem.prior.mean[BACKLASH], problem.prior.deviation[BACKLASH]
    backlashes = [float((log(arcmin) - mean) / deviation) for arcmin in _BACKLASH_STARTS_ARCMIN]
    found = _in_units(problem.prior, estimate(problem.posterior, BACKLASH, backlashes, progress))
    return Identified(
        with_logarithms(config, found.vector[: len(PARAMETERS)]),
        constants_of(config, found, problem.prior.deviation, isinstance(recording, DriveRecording)),
        found,
        problem.time_s,
        problem.seen_deg,
        found.predicted_deg,
        problem.posterior.readings.outside_deg(found.predicted_deg),
    )


def _in_units(prior: Prior, found: Estimate) -> Estimate:
    """Return an estimate in the units of the parameters instead of the prior's."""
    squares = np.outer(prior.deviation, prior.deviation)
    return found._replace(
        vector=prior.mean + prior.deviation * found.vector,
        covariance=found.covariance * squares,
        halves=(_half_in_units(prior, found.halves[0]), _half_in_units(prior, found.halves[1])),
    )


def _half_in_units(prior: Prior, half: Half) -> Half:
    squares = np.outer(prior.deviation, prior.deviation)
    return Half(prior.mean + prior.deviation * half.vector, half.covariance * squares)
