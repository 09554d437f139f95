"""Runs of the compiled emulator in everyday units: seconds, degrees, duty as a share."""

from dataclasses import replace
from random import Random
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from emulator.config.table_config import GainsConfig, GainSetsConfig, TableConfig
from emulator.firmware.fixed_point import to_fixed
from emulator.firmware.profiler import Profile
from emulator.plant.drive_train import at_standstill
from emulator.table.batch import COLUMNS, MOVE_BY, MOVE_TO, run
from emulator.table.tick import TableConstants, TableState, table_constants, woken

Array = NDArray[np.float64]


class Motion(NamedTuple):
    """A motion command, executed at a time; `by` distinguishes an increment (R) from a position (P)."""

    time_s: float
    angle_deg: float
    speed_deg_s: float
    acceleration_deg_s2: float
    by: bool = False


class Load(NamedTuple):
    """A load torque at the table from a given time on."""

    time_s: float
    torque_Nm: float


class Answer(NamedTuple):
    """The motion of the table, an entry for each tick. True angles and speeds are behind the backlash."""

    time_s: Array
    reference_deg: Array
    encoder_deg: Array
    true_deg: Array
    reference_speed_deg_s: Array
    measured_deg_s: Array
    motor_speed_deg_s: Array  # as the table would turn with it
    true_speed_deg_s: Array
    duty: Array
    motion: Array


def with_gains(config: TableConfig, ramp: GainsConfig, hold: GainsConfig) -> TableConfig:
    """Return the same table with other gain sets."""
    return replace(config, gains=GainSetsConfig(ramp, hold))


def switched_on(config: TableConfig, seed: int) -> tuple[TableConstants, TableState]:
    """Return a table at rest.

    The seed determines the position of the shaft between two counts, and of the teeth in the gap.
    """
    chance = Random(seed)  # noqa: S311  # not for security
    constants = table_constants(config, encoder_phase=chance.random())
    drive = at_standstill(constants.drive, gap_share=chance.uniform(-1.0, 1.0))
    return constants, woken(constants, drive, Profile.of(1, 1))


def motion_rows(config: TableConfig, motions: list[Motion]) -> NDArray[np.int64]:
    """Return motions in the format of `emulator.table.batch`."""
    count_deg, tick_hz, bits = config.counts_per_deg, config.control.tick_hz, config.motion_bits
    rows = [
        (
            round(motion.time_s * tick_hz),
            MOVE_BY if motion.by else MOVE_TO,
            to_fixed(motion.angle_deg * count_deg, bits),
            to_fixed(motion.speed_deg_s * count_deg / tick_hz, bits),
            to_fixed(motion.acceleration_deg_s2 * count_deg / tick_hz**2, bits),
        )
        for motion in motions
    ]
    return np.array(rows, dtype=np.int64).reshape(-1, 5)


def emulate(
    config: TableConfig, motions: list[Motion], duration_s: float, loads: list[Load] | None = None, seed: int = 0
) -> Answer:
    """Run a table from rest through motions and loads, in the order of their times."""
    constants, state = switched_on(config, seed)
    tick_hz = config.control.tick_hz
    load_rows = np.array([(load.time_s * tick_hz, load.torque_Nm) for load in loads or []]).reshape(-1, 2)
    ticks = round(duration_s * tick_hz)
    _, samples = run(constants, state, ticks, motion_rows(config, motions), load_rows)
    column = {name: samples[:, index] for index, name in enumerate(COLUMNS)}
    count_deg = config.counts_per_deg
    window = config.control.speed_window_ticks
    return Answer(
        time_s=np.arange(1, ticks + 1) / tick_hz,
        reference_deg=column["reference_count"] / count_deg,
        encoder_deg=column["encoder_count"] / count_deg,
        true_deg=np.degrees(column["table_angle_rad"]),
        reference_speed_deg_s=column["reference_speed"] / 2.0**config.motion_bits * tick_hz / count_deg,
        measured_deg_s=column["measured"] / window * tick_hz / count_deg,
        motor_speed_deg_s=np.degrees(column["motor_speed_rad_s"]) / config.gears.ratio,
        true_speed_deg_s=np.degrees(column["table_speed_rad_s"]),
        duty=column["duty"] / config.driver.duty_max,
        motion=column["motion"],
    )
