"""Simulate a table with given constants instead of the recorded one.

In a recording over the wire the duty is not visible. But it follows from the commands, so the whole emulator runs,
including the controller. A drive's duty is recorded, so then only the plant runs.
"""

from functools import cache
from math import ceil
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from emulator.config.constants import drive_constants
from emulator.config.table_config import TableConfig
from emulator.firmware.profiler import Profile
from emulator.plant import drive_train
from emulator.plant.drive_train import DriveState, DriveTrain, at_standstill
from emulator.table.batch import COLUMNS, run
from emulator.table.tick import table_constants, woken
from protocol.program.interrupts import signals_wait
from tools.emulated import Array, Motion, motion_rows
from tools.identification.recording import DriveRecording, WireRecording

_ANGLE = COLUMNS.index("motor_angle_rad")
_REFERENCE_SPEED = COLUMNS.index("reference_speed")


class Standstill(NamedTuple):
    """The initial state of a table.

    A number beyond its range is folded back into it, so that a search needs no bounds.
    """

    encoder_phase: float = 0.5  # position of the shaft between two counts, 0..1
    gap_share: float = 0.0  # position of the teeth from mid-gap to a flank, -1..1


MIDDLE = Standstill()


def commanded_motions(config: TableConfig, recording: WireRecording, ticks: Array) -> NDArray[np.int64]:
    """Return the motions of a recording for `emulator.table.batch`, from the position of the first reading.

    Args:
        config: the table.
        recording: the commands.
        ticks: (commands,) at whose end the commands were executed.
    """
    speed, acceleration = config.power_on.speed_deg_s, config.power_on.acceleration_deg_s2
    start_deg = recording.position_deg[0]
    motions = []
    for (_, verb, value, _), tick in zip(recording.commands, ticks, strict=True):
        if verb == "S":
            speed = value
        elif verb == "A":
            acceleration = value
        else:
            angle_deg = value if verb == "R" else value - start_deg
            motions.append(Motion(tick / config.control.tick_hz, angle_deg, speed, acceleration, by=verb == "R"))
    return motion_rows(config, motions)


def wire_positions_deg(
    config: TableConfig, motions: NDArray[np.int64], ticks: Array, start: Standstill = MIDDLE
) -> Array:
    """Return the encoder position at given ticks, which may have fractions, from its initial position."""
    angle = _samples(config, motions, ceil(ticks.max()) + 2, start)[:, _ANGLE]
    angle = np.concatenate([[0.0], angle])
    tick = np.clip(np.floor(ticks).astype(np.int64), 0, len(angle) - 2)
    share = ticks - tick
    turned = angle[tick] * (1.0 - share) + angle[tick + 1] * share
    return np.degrees(turned) / config.gears.ratio


def from_rest(config: TableConfig, motions: NDArray[np.int64]) -> NDArray[np.bool_]:
    """Return which motions start while the profile stands."""
    speed = _samples(config, motions, int(motions[-1, 0]) + 1, MIDDLE)[:, _REFERENCE_SPEED]
    before: NDArray[np.bool_] = np.concatenate([[0.0], speed])[motions[:, 0]] == 0.0
    return before


def _samples(config: TableConfig, motions: NDArray[np.int64], ticks: int, start: Standstill) -> Array:
    constants = table_constants(config, encoder_phase=start.encoder_phase % 1.0)
    drive = at_standstill(constants.drive, gap_share=abs((start.gap_share - 1.0) % 4.0 - 2.0) - 1.0)
    return run(constants, woken(constants, drive, Profile.of(1, 1)), ticks, motions)[1]


def drive_positions_deg(config: TableConfig, duty: Array, delay_ticks: float) -> Array:
    """Return the table's position from the motor, at the end of each tick.

    Args:
        config: the table.
        duty: (n,) as computed at the end of each tick.
        delay_ticks: delay until it is on the bridge, from 0; a fraction of a tick mixes two neighbors.
    """
    whole = int(delay_ticks)
    padded = np.concatenate([np.zeros(whole + 2), duty])[: len(duty) + 1]
    share = delay_ticks - whole
    applied = (padded[1:] * (1.0 - share) + padded[:-1] * share) * config.driver.supply_V
    train = drive_constants(config)
    angle = np.empty(len(duty))
    with signals_wait():
        _compiled_open_loop()(train, at_standstill(train, MIDDLE.gap_share), applied, angle)
    return np.degrees(angle) / config.gears.ratio


def ticks_of(recording: DriveRecording, tick_hz: int) -> tuple[Array, Array]:
    """Return duty and position at every tick; ticks that a trace omits have no change."""
    tick = np.round((recording.time_s - recording.time_s[0]) * tick_hz).astype(np.int64)
    row = np.searchsorted(tick, np.arange(tick[-1] + 1), side="right") - 1
    return recording.duty[row], recording.position_deg[row]


def _open_loop(train: DriveTrain, state: DriveState, voltage_V: Array, angle_rad: Array) -> None:
    for tick in range(len(voltage_V)):
        state = drive_train.step(train, state, voltage_V[tick], 0.0)
        angle_rad[tick] = state.angle_rad


@cache
def _compiled_open_loop() -> Any:  # noqa: ANN401  # numba's dispatcher
    from emulator.table.machine_code import compiled  # noqa: PLC0415  # numba is imported only when it is used

    return compiled(_open_loop)
