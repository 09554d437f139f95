"""When the lines of a recording were carried out, in the table's ticks.

A line cannot be carried out before it is complete, nor after its reply. The time between is what is doubtful of it: a
tick or so, and more when the recording computer was busy. A table that answers at its ticks sends its replies on a
grid. Where the replies come on one, it tells the very tick of each.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from emulator.config import TableConfig
from tools.emulated import Array
from tools.identification.recording import BITS_A_BYTE, WireRecording

_GRID = 0.5
"""How much of the replies' phase within a tick is common to them, at least, if they come on a grid: 0..1."""

_CLOCK_RATES = 1e-6 * np.arange(-200.0, 201.0)
"""By how much the recorder's clock may run faster than the table's."""

_DOUBTFUL_TICKS = 0.8
"""How much later than most a reply may come."""


class Timing(NamedTuple):
    """The ticks at whose end lines were carried out, and which of them are in doubt."""

    exact: bool  # but for lines in doubt; otherwise the replies come on no grid, and tell no tick
    readings: Array  # (readings,)
    commands: Array  # (commands,)
    doubtful_readings: NDArray[np.bool_]
    doubtful_commands: NDArray[np.bool_]


def timing(config: TableConfig, recording: WireRecording) -> Timing:
    """Return when the lines of a recording were carried out; without the times of replies, as soon as they could be."""
    tick_hz, count = config.control.tick_hz, len(recording.time_s)
    sent = tick_hz * np.concatenate([recording.time_s, [sent.time_s for sent in recording.commands]])
    soonest = np.ceil(sent - 1e-3)
    latest = tick_hz * np.concatenate([recording.reply_s, [sent.reply_s for sent in recording.commands]])
    latest -= _reply_ticks(config, recording)
    if not np.isfinite(latest).all():
        sure = np.zeros(len(sent), dtype=bool)
        return Timing(True, soonest[:count], soonest[count:], sure[:count], sure[count:])
    phases = [np.mean(np.exp(2j * np.pi * latest[:count] * (1.0 - rate))) for rate in _CLOCK_RATES]
    best = int(np.argmax(np.abs(phases)))
    on_grid = bool(abs(phases[best]) > _GRID)
    on_table = latest * (1.0 - _CLOCK_RATES[best]) - np.angle(phases[best]) / (2.0 * np.pi)
    tick = np.round(on_table) if on_grid else soonest
    margin = latest - sent
    usual = np.quantile(margin[:count], 0.1)
    doubtful = margin > max(usual + _DOUBTFUL_TICKS, float(np.median(margin[:count])))
    return Timing(on_grid, tick[:count], tick[count:], doubtful[:count], doubtful[count:])


def _reply_ticks(config: TableConfig, recording: WireRecording) -> Array:
    """Return how long the replies were on the line; the controller sends a byte at the end of a tick."""
    baud, tick_hz = config.serial.baud, config.control.tick_hz
    decimals = round(-np.log10(recording.resolution_deg))
    lengths = [len(f"H {angle:.{decimals}f}\r") for angle in recording.position_deg]
    lengths += [len("OK\r")] * len(recording.commands)
    return np.ceil(np.array(lengths) * BITS_A_BYTE * tick_hz / baud) if baud else np.zeros(len(lengths))
