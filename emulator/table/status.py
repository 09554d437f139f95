"""The observable state of a table on the bench, from its configuration and its state."""

import math

from emulator.config.table_config import TableConfig
from emulator.firmware.controller import STATE_NAMES
from emulator.firmware.fixed_point import from_fixed
from emulator.firmware.pid import RAMP
from emulator.line.uart import Uart
from emulator.plant.encoder import Encoder
from emulator.table.tick import TableState
from protocol.bench import TableFacts, TableStatus


def table_facts(config: TableConfig) -> TableFacts:
    """Return the constants that clients may use."""
    limits = config.limits
    return TableFacts(config.control.tick_hz, config.counts_per_deg, limits.speed_deg_s, limits.acceleration_deg_s2)


def table_status(
    config: TableConfig,
    state: TableState,
    uart: Uart,
    *,
    encoder: Encoder,
    tick: int,
    latched_count: int,
    load_torque_Nm: float,
    true_zero_rad: float,
) -> TableStatus:
    """Return the state of plant, controller and line; the true angle counts from `true_zero_rad`."""
    drive, controller, _ = state
    reference, regulator = controller.reference, controller.pid
    count_deg = config.counts_per_deg
    speed_deg_s = config.control.tick_hz / count_deg  # speed of one count per tick
    return TableStatus(
        tick=tick,
        reference_deg=(reference.position_count + from_fixed(reference.fraction, config.motion_bits)) / count_deg,
        encoder_deg=controller.counts[-1] / count_deg,
        true_deg=math.degrees(drive.table_angle_rad - true_zero_rad),
        reference_speed_deg_s=from_fixed(reference.speed, config.motion_bits) * speed_deg_s,
        speed_deg_s=regulator.measured / config.control.speed_window_ticks * speed_deg_s,
        true_speed_deg_s=math.degrees(drive.table_speed_rad_s),
        current_A=drive.current_A,
        duty=regulator.duty / config.driver.duty_max,
        gain_set="ramp" if regulator.gain_set == RAMP else "hold",
        state=STATE_NAMES[controller.motion],
        latched_deg=latched_count / count_deg,
        received_queue=uart.waiting_count,
        transmit_queue=uart.transmit_count,
        lost_bytes=uart.lost_bytes,
        load_torque_Nm=load_torque_Nm,
        # A count represents all angles from its edge to the next one, so its value is the middle.
        shaft_deg=(drive.angle_rad * encoder.count_rad + encoder.phase - 0.5) / count_deg,
        gap_deg=math.degrees(drive.angle_rad / config.gears.ratio - drive.table_angle_rad),
    )
