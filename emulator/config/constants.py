"""The constants of plant and controller from a table's configuration, per tick and in the firmware's formats."""

from emulator.config.table_config import ConfigError, GainsConfig, TableConfig
from emulator.firmware.controller import Firmware
from emulator.firmware.fixed_point import gain_registers, to_fixed
from emulator.firmware.pid import Gains, Pid
from emulator.plant.drive_train import DriveTrain, Gears
from emulator.plant.encoder import Encoder
from emulator.plant.friction import Friction
from emulator.plant.motor import Motor


def drive_constants(config: TableConfig) -> DriveTrain:
    """Return the plant of a configured table."""
    motor, gears, friction = config.motor, config.gears, config.friction
    return DriveTrain.of(
        Motor(
            motor.resistance_ohm,
            motor.inductance_H,
            motor.torque_constant_Nm_A,
            motor.rotor_inertia_kg_m2,
            friction.viscous_Nm_s,
        ),
        Gears(gears.ratio, gears.efficiency, gears.inertia_kg_m2, gears.backlash_arcmin),
        Friction(
            friction.coulomb_Nm, friction.coulomb_Nm * friction.stiction_ratio, 1.0 / friction.stribeck_speed_rad_s
        ),
        table_inertia_kg_m2=config.table.inertia_kg_m2,
        bearing_friction_Nm=config.table.bearing_friction_Nm,
        tick_s=1.0 / config.control.tick_hz,
    )


def encoder_constants(config: TableConfig, phase: float) -> Encoder:
    """Return the encoder of a configured table. `phase` (0..1) is the position of the shaft between two edges."""
    return Encoder.of(config.encoder.lines, phase)


def firmware_constants(config: TableConfig) -> Firmware:
    """Return the controller of a configured table, with its gains rounded to the firmware's formats.

    Raises:
        ConfigError: a gain does not fit its register, or the integral gain rounds to 0.
    """
    tick_hz = config.control.tick_hz
    settling, protection, gains, bits = config.settling, config.protection, config.gains, config.motion_bits
    approach_deg_s = min(settling.approach_speed_deg_s, config.limits.speed_deg_s)
    return Firmware(
        pid=Pid(fixed_gains(config, gains.ramp), fixed_gains(config, gains.hold), config.driver.duty_max),
        motion_bits=bits,
        window_ticks=config.control.speed_window_ticks,
        arrival_count=settling.arrival_count,
        arrival_ticks=max(1, round(settling.arrival_time_s * tick_hz)),
        approach_rate=to_fixed(settling.approach_rate_1_s / tick_hz, bits),
        approach_speed=to_fixed(approach_deg_s * float(config.counts_per_turn) / 360.0 / tick_hz, bits),
        stall_duty=round(protection.stall_duty * config.driver.duty_max),
        stall_ticks=max(1, round(protection.stall_time_s * tick_hz)),
        settling_ticks=max(1, round(protection.settling_time_s * tick_hz)),
    )


def fixed_gains(config: TableConfig, gains: GainsConfig) -> Gains:
    """Return a gain set of a table in the firmware's formats.

    Raises:
        ConfigError: a gain does not fit its register, or the integral gain rounds to 0.
    """
    try:
        return Gains(*gain_registers(*config.gains_per_tick(gains)))
    except OverflowError as error:
        raise ConfigError(f"{gains} does not fit the firmware: {error}") from None
