"""When the lines of a recording were carried out, in the table's ticks.

A line cannot be carried out before it is complete, nor after its reply. The time between is what is doubtful of it: a
tick or so, and more when the recording computer was busy. A table that answers at its ticks sends its replies on a
grid. Where the replies come on one, it tells the very tick of each.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from emulator.config.table_config import TableConfig
from tools.emulated import Array
from tools.identification.recording import BITS_A_BYTE, WireRecording
from tools.identification.reply_grid import reply_grid

_DOUBTFUL_TICKS = 0.8
"""How much later than most a reply may come."""


class Timing(NamedTuple):
    """The ticks at whose end lines were carried out, and which of them are in doubt."""

    fault: str  # why the ticks are not known, in one sentence, or empty
    readings: Array  # (readings,)
    commands: Array  # (commands,)
    doubtful_readings: NDArray[np.bool_]
    doubtful_commands: NDArray[np.bool_]


def timing(config: TableConfig, recording: WireRecording) -> Timing:
    """Return when the lines of a recording were carried out; without the times of replies, as soon as they could be."""
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
    """Return how long the replies were on the line; the controller sends a byte at the end of a tick."""
    baud, tick_hz = config.serial.baud, config.control.tick_hz
    decimals = round(-np.log10(recording.resolution_deg))
    lengths = [len(f"H {angle:.{decimals}f}\r") for angle in recording.position_deg]
    lengths += [len("OK\r")] * len(recording.commands)
    return np.ceil(np.array(lengths) * BITS_A_BYTE * tick_hz / baud) if baud else np.zeros(len(lengths))
