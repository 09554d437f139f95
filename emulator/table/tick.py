"""One tick of the whole table: from voltage to motion to counts to the next voltage.

A pure function of constants, state and inputs, in the subset of Python that numba compiles. The emulator interprets it,
and `batch` compiles it, with bit-identical results. The new duty waits in the PWM's buffer for one tick, because the
controller computes while the old duty is applied.
"""

from typing import NamedTuple

from emulator.config.constants import drive_constants, encoder_constants, firmware_constants
from emulator.config.table_config import TableConfig
from emulator.firmware.controller import DRIVE_OFF, Firmware, FirmwareState, power_on
from emulator.firmware.controller import step as firmware_step
from emulator.firmware.profiler import Profile
from emulator.plant.drive_train import DriveState, DriveTrain
from emulator.plant.drive_train import step as drive_step
from emulator.plant.encoder import Encoder, count_at


class TableConstants(NamedTuple):
    """All constants of a table, per tick."""

    drive: DriveTrain
    encoder: Encoder
    firmware: Firmware
    volts_per_duty: float


class TableState(NamedTuple):
    """Plant and controller at the end of a tick."""

    drive: DriveState
    firmware: FirmwareState
    duty: int  # applied in the coming tick, PWM steps


def table_constants(config: TableConfig, encoder_phase: float) -> TableConstants:
    """Return the constants of a configured table."""
    return TableConstants(
        drive_constants(config),
        encoder_constants(config, encoder_phase),
        firmware_constants(config),
        config.driver.supply_V / config.driver.duty_max,
    )


def woken(constants: TableConstants, drive: DriveState, profile: Profile) -> TableState:
    """Return the table at power-on of its controller.

    The plant stays as it is, and `profile` applies until the first motion command.
    """
    count = count_at(constants.encoder, drive.angle_rad)
    return TableState(drive, power_on(constants.firmware, profile, count), 0)


def step(constants: TableConstants, state: TableState, load_torque_Nm: float) -> TableState:
    """Return the table one tick later."""
    drive, controller, duty = _step(constants, state.drive, state.firmware, state.duty, load_torque_Nm)
    return TableState(drive, controller, duty)


def run_undisturbed(
    constants: TableConstants, state: TableState, load_torque_Nm: float, ticks: int
) -> tuple[TableState, bool]:
    """Return the table after ticks without external events, and whether it rests.

    A resting state is one whose step returns itself: it does not change any more, and the remaining ticks need no
    computation.
    """
    drive, controller, duty = state
    for _ in range(ticks):
        before = (drive, controller, duty)
        drive, controller, duty = _step(constants, drive, controller, duty, load_torque_Nm)
        if controller.motion in DRIVE_OFF and (drive, controller, duty) == before:
            return TableState(drive, controller, duty), True
    return TableState(drive, controller, duty), False


def _step(
    constants: TableConstants, drive: DriveState, controller: FirmwareState, duty: int, load_torque_Nm: float
) -> tuple[DriveState, FirmwareState, int]:
    """Return the fields of the state one tick later. A `TableState` is created only when it is read."""
    train, shaft_encoder, controller_constants, volts_per_duty = constants
    drive = drive_step(train, drive, duty * volts_per_duty, load_torque_Nm)
    count = count_at(shaft_encoder, drive.angle_rad)
    return drive, firmware_step(controller_constants, controller, count), controller.pid.duty
