"""The effect of faults on the drive and the encoder: the tick of a faulty table."""

import math

from emulator.faults.fault import (
    DeadEncoder,
    ExtraLoad,
    LostCounts,
    OneSided,
    Stall,
    StuckPwm,
    SupplySag,
    SwappedEncoder,
)
from emulator.faults.schedule import FaultSchedule
from emulator.firmware.controller import step as firmware_step
from emulator.int32 import wrap_int32
from emulator.plant.drive_train import DriveState
from emulator.plant.drive_train import step as drive_step
from emulator.plant.encoder import count_at
from emulator.plant.friction import Friction
from emulator.table.tick import TableConstants, TableState
from protocol.bench import Fault

DRIVE_KINDS: frozenset[type[Fault]] = frozenset(
    (Stall, ExtraLoad, SupplySag, StuckPwm, OneSided, LostCounts, SwappedEncoder, DeadEncoder)
)
"""The faults that this module implements."""
_HELD_OVER_STALL = 4.0
"""The torque that blocks a stalled table; it exceeds the motor's own stall torque."""


def is_faulty(faults: FaultSchedule) -> bool:
    """Return whether a tick of plant and controller differs from that of a healthy table."""
    return faults.holds_any(DRIVE_KINDS)


def faulty_step(
    faults: FaultSchedule, constants: TableConstants, state: TableState, load_torque_Nm: float, supply_V: float
) -> tuple[TableConstants, TableState]:
    """Return the table one tick later, as `tick.step` does.

    Missed counts stay missed: they shift the encoder's phase.
    """
    drive = _drive_step(faults, constants, state, load_torque_Nm, supply_V)
    before = state.firmware.counts[-1]
    turned = wrap_int32(count_at(constants.encoder, drive.angle_rad) - before)
    counted = _counted(faults, turned)
    if counted != turned:
        phase = constants.encoder.phase + (counted - turned)
        constants = constants._replace(encoder=constants.encoder._replace(phase=phase))
    controller = firmware_step(constants.firmware, state.firmware, wrap_int32(before + counted))
    return constants, TableState(drive, controller, state.firmware.pid.duty)


def _drive_step(
    faults: FaultSchedule, constants: TableConstants, state: TableState, load_torque_Nm: float, supply_V: float
) -> DriveState:
    duty, supply_share, train = state.duty, 1.0, constants.drive
    if stuck := faults.holding(StuckPwm):
        duty = round(stuck.duty * constants.firmware.pid.duty_max)
    if (one_sided := faults.holding(OneSided)) and duty * one_sided.direction <= 0:
        duty = 0
    if sag := faults.holding(SupplySag):
        supply_share = sag.supply_V / supply_V
    if load := faults.holding(ExtraLoad):
        load_torque_Nm += load.torque_Nm
    if faults.holding(Stall):
        holding_Nm = _HELD_OVER_STALL * train.torque_constant_Nm_A * supply_V / train.resistance_ohm
        train = train._replace(friction=Friction(holding_Nm, holding_Nm, train.friction.stribeck_s_rad))
    return drive_step(train, state.drive, duty * supply_share * constants.volts_per_duty, load_torque_Nm)


def _counted(faults: FaultSchedule, turned: int) -> int:
    """Return the change of the counter for a rotation of the shaft by the given counts."""
    if faults.holding(DeadEncoder):
        return 0
    if lost := faults.holding(LostCounts):
        seen = sum(not faults.strikes(lost.probability) for _ in range(abs(turned)))
        turned = int(math.copysign(seen, turned))
    return -turned if faults.holding(SwappedEncoder) else turned
