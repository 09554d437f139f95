"""The execution times of the lines of a recording, in the table's ticks.

A line is executed after its complete arrival and before its reply. The time between the two is the uncertainty: about a
tick, and more if the recording computer was busy. A table that replies at its ticks sends its replies on a grid. If the
replies are on a grid, it determines the exact tick of each.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from emulator.config.table_config import TableConfig
from tools.emulated import Array
from tools.identification.recording import BITS_A_BYTE, WireRecording
from tools.identification.reply_grid import reply_grid

_DOUBTFUL_TICKS = 0.8
"""Maximum delay of a reply relative to most others."""


class Timing(NamedTuple):
    """The ticks at whose end lines were executed, and which of them are uncertain."""

    fault: str  # why the ticks are unknown, in one sentence, or empty
    readings: Array  # (readings,)
    commands: Array  # (commands,)
    doubtful_readings: NDArray[np.bool_]
    doubtful_commands: NDArray[np.bool_]


def timing(config: TableConfig, recording: WireRecording) -> Timing:
    """Return the execution times of the lines of a recording; without times of replies, the earliest possible ones."""
    tick_hz, count = config.control.tick_hz, len(recording.time_s)
    sent = tick_hz * np.concatenate([recording.time_s, [sent.time_s for sent in recording.commands]])
    soonest = np.ceil(sent - 1e-3)
    arrived = tick_hz * np.concatenate([recording.reply_s, [sent.reply_s for sent in recording.commands]])
    if not np.isfinite(arrived).all():
        sure = np.zeros(len(sent), dtype=bool)
        return Timing("", soonest[:count], soonest[count:], sure[:count], sure[count:])
    latest = arrived - _reply_ticks(config, recording)
    grid = reply_grid(arrived[:count], latest[:count])
    tick = soonest if grid.fault else np.round(grid.ticks(latest))
    margin = latest - sent
    usual = np.quantile(margin[:count], 0.1)
    doubtful = margin > max(usual + _DOUBTFUL_TICKS, float(np.median(margin[:count])))
    return Timing(grid.fault, tick[:count], tick[count:], doubtful[:count], doubtful[count:])


def _reply_ticks(config: TableConfig, recording: WireRecording) -> Array:
    """Return the transmission times of the replies; the controller sends a byte at the end of a tick."""
    baud, tick_hz = config.serial.baud, config.control.tick_hz
    decimals = round(-np.log10(recording.resolution_deg))
    lengths = [len(f"H {angle:.{decimals}f}\r") for angle in recording.position_deg]
    lengths += [len("OK\r")] * len(recording.commands)
    return np.ceil(np.array(lengths) * BITS_A_BYTE * tick_hz / baud) if baud else np.zeros(len(lengths))
