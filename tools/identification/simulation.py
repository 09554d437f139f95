"""What a table with given constants would answer in the place of the recorded one.

Over the wire the duty is not seen; but it follows from the commands, so the whole emulator runs, controller included. A
drive's duty is known, so there the plant runs alone.
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
from protocol.interrupts import signals_wait
from tools.emulated import Array, Motion, motion_rows
from tools.identification.recording import DriveRecording, WireRecording

_ANGLE = COLUMNS.index("motor_angle_rad")
_REFERENCE_SPEED = COLUMNS.index("reference_speed")


class Standstill(NamedTuple):
    """How a table stands at first. A number beyond its range is folded back into it: a search needs no bounds."""

    encoder_phase: float = 0.5  # how far the shaft is between two counts, 0..1
    gap_share: float = 0.0  # how far the teeth are from mid-gap towards a flank, -1..1


MIDDLE = Standstill()


def commanded_motions(config: TableConfig, recording: WireRecording, ticks: Array) -> NDArray[np.int64]:
    """Return the motions of a recording as `emulator.table.batch` takes them, from the position of the first reading.

    Args:
        config: The table.
        recording: What was commanded.
        ticks: (commands,) at whose end the commands were carried out.
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
    """Return where the encoder would be at given ticks, which may have fractions, from where it was at the start."""
    angle = _samples(config, motions, ceil(ticks.max()) + 2, start)[:, _ANGLE]
    angle = np.concatenate([[0.0], angle])
    tick = np.clip(np.floor(ticks).astype(np.int64), 0, len(angle) - 2)
    share = ticks - tick
    turned = angle[tick] * (1.0 - share) + angle[tick + 1] * share
    return np.degrees(turned) / config.gears.ratio


def from_rest(config: TableConfig, motions: NDArray[np.int64]) -> NDArray[np.bool_]:
    """Tell which motions begin when the profile stands."""
    speed = _samples(config, motions, int(motions[-1, 0]) + 1, MIDDLE)[:, _REFERENCE_SPEED]
    before: NDArray[np.bool_] = np.concatenate([[0.0], speed])[motions[:, 0]] == 0.0
    return before


def _samples(config: TableConfig, motions: NDArray[np.int64], ticks: int, start: Standstill) -> Array:
    constants = table_constants(config, encoder_phase=start.encoder_phase % 1.0)
    drive = at_standstill(constants.drive, gap_share=abs((start.gap_share - 1.0) % 4.0 - 2.0) - 1.0)
    return run(constants, woken(constants, drive, Profile.of(1, 1)), ticks, motions)[1]


def drive_positions_deg(config: TableConfig, duty: Array, delay_ticks: float) -> Array:
    """Return where the motor turns the table to, at the end of each tick.

    Args:
        config: The table.
        duty: (n,) as computed at the end of each tick.
        delay_ticks: From there to when it is on the bridge, from 0; a fraction of a tick mixes two neighbors.
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
    """Return duty and position at every tick; what a trace leaves out has not changed."""
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
