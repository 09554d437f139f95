"""The table's constants: one frozen dataclass per section of the TOML file. Each number has its unit and its range.

The numbers and their sources are in `default.toml`.
"""

from dataclasses import asdict, dataclass, replace
from fractions import Fraction
from functools import cached_property
from math import ceil, inf
from pathlib import Path
from typing import Self

from emulator.config.gear_ratio import simplest_fraction
from emulator.faults.fault import FaultError, fault_from
from emulator.firmware.fixed_point import ERROR_BITS, ERROR_MAX, gain_registers, motion_bits
from emulator.int32 import INT32_MAX
from protocol.bench import Fault
from protocol.files.data_file import read_toml
from protocol.files.toml_section import quantity, section
from protocol.files.toml_table import TomlTable

DEFAULT_FILE = Path(__file__).with_name("default.toml")

_FINER = "a higher encoder.lines or gears.ratio, a lower control.tick_hz or a lower limit"
_COARSER = "a lower encoder.lines or gears.ratio, a higher control.tick_hz or a shorter control.speed_window_ticks"


class ConfigError(ValueError):
    """A configuration that cannot be used. The message names the file, the key and the allowed values."""


@dataclass(frozen=True)
class MotorConfig:
    """The DC motor, from its datasheet."""

    resistance_ohm: float = quantity(at_least=1e-3, at_most=1e4)
    inductance_H: float = quantity(at_least=1e-6, at_most=10)
    torque_constant_Nm_A: float = quantity(at_least=1e-6, at_most=100)
    rotor_inertia_kg_m2: float = quantity(at_least=1e-10, at_most=10)


@dataclass(frozen=True)
class DriverConfig:
    """The PWM bridge."""

    supply_V: float = quantity(above=0, at_most=1000)
    pwm_bits: int = quantity(at_least=4, at_most=11)

    @property
    def duty_max(self) -> int:
        """PWM steps at full duty."""
        return (1 << self.pwm_bits) - 1


@dataclass(frozen=True)
class GearsConfig:
    """The spur gears between motor and table."""

    ratio: float = quantity(at_least=1, at_most=1e5, fraction=True)
    efficiency: float = quantity(at_least=0.01, at_most=1)
    inertia_kg_m2: float = quantity(at_least=0, at_most=10)
    backlash_arcmin: float = quantity(at_least=0, at_most=600)


@dataclass(frozen=True)
class DiscConfig:
    """The disc of the table with the workpiece."""

    inertia_kg_m2: float = quantity(at_least=1e-9, at_most=1e6)
    bearing_friction_Nm: float = quantity(at_least=0, at_most=1e5)


@dataclass(frozen=True)
class FrictionConfig:
    """Friction of motor and gears, at the motor's shaft."""

    coulomb_Nm: float = quantity(at_least=0, at_most=1e3)
    stiction_ratio: float = quantity(at_least=1, at_most=10)
    stribeck_speed_rad_s: float = quantity(at_least=1e-3, at_most=1e4)
    viscous_Nm_s: float = quantity(at_least=0, at_most=1)


@dataclass(frozen=True)
class EncoderConfig:
    """The quadrature encoder on the motor's shaft."""

    lines: int = quantity(at_least=1, at_most=10_000)


@dataclass(frozen=True)
class ControlConfig:
    """The firmware's clock and speed estimate."""

    tick_hz: int = quantity(at_least=100, at_most=100_000)
    speed_window_ticks: int = quantity(at_least=1, at_most=256)


@dataclass(frozen=True)
class GainsConfig:
    """One PID gain set: u = K (e + integral(e) / Ti - Td d(omega)/dt), e in deg/s, u = 1 at full duty."""

    proportional_duty_s_deg: float = quantity(at_least=0, at_most=1e6)
    integral_time_s: float = quantity(at_least=1e-6, at_most=1e6)
    derivative_time_s: float = quantity(at_least=0, at_most=1e3)


@dataclass(frozen=True)
class GainSetsConfig:
    """The two gain sets of section 2.1 of the paper: following a ramp, and holding a speed."""

    ramp: GainsConfig
    hold: GainsConfig


@dataclass(frozen=True)
class SettlingConfig:
    """How the table reaches its target after the end of the profile."""

    arrival_count: int = quantity(at_least=0, at_most=100)
    arrival_time_s: float = quantity(at_least=0, at_most=10)
    approach_rate_1_s: float = quantity(above=0, at_most=100)
    approach_speed_deg_s: float = quantity(above=0, at_most=1e6)


@dataclass(frozen=True)
class ProtectionConfig:
    """When the motor is switched off because it does not turn."""

    stall_duty: float = quantity(above=0, at_most=1)
    stall_time_s: float = quantity(above=0, at_most=3600)
    settling_time_s: float = quantity(above=0, at_most=3600)


@dataclass(frozen=True)
class MotionConfig:
    """A speed and an acceleration of the table."""

    speed_deg_s: float = quantity(above=0, at_most=1e6)
    acceleration_deg_s2: float = quantity(above=0, at_most=1e9)


@dataclass(frozen=True)
class SerialConfig:
    """The serial line."""

    baud: int = quantity(at_least=0, at_most=4_000_000)
    decimals: int = quantity(at_least=1, at_most=6)
    strict: bool = quantity()


@dataclass(frozen=True)
class TableConfig:
    """All constants of a table. The file of the default values states the source of each."""

    motor: MotorConfig
    driver: DriverConfig
    gears: GearsConfig
    table: DiscConfig
    friction: FrictionConfig
    encoder: EncoderConfig
    control: ControlConfig
    gains: GainSetsConfig
    settling: SettlingConfig
    protection: ProtectionConfig
    limits: MotionConfig
    power_on: MotionConfig
    serial: SerialConfig
    faults: tuple[Fault, ...] = ()  # [[faults]] of a file; the default file has none

    @cached_property
    def counts_per_turn(self) -> Fraction:
        """Exact encoder counts per turn of the table: quadrature gives four counts per line."""
        return 4 * self.encoder.lines * simplest_fraction(self.gears.ratio)

    @cached_property
    def counts_per_deg(self) -> float:
        """Encoder counts in one degree of the table."""
        return float(self.counts_per_turn) / 360.0

    @cached_property
    def motion_bits(self) -> int:
        """Fraction bits of position, speed and acceleration in the firmware, see `fixed_point`."""
        return motion_bits(*self._counts_per_tick(self.limits))

    def _counts_per_tick(self, motion: MotionConfig) -> tuple[Fraction, Fraction]:
        """Return a speed in count/tick and an acceleration in count/tick^2."""
        tick_hz, count_deg = self.control.tick_hz, self.counts_per_turn / 360
        return (
            Fraction(motion.speed_deg_s) * count_deg / tick_hz,
            Fraction(motion.acceleration_deg_s2) * count_deg / tick_hz**2,
        )

    def gains_per_tick(self, gains: GainsConfig) -> tuple[float, float, float]:
        """Return K, K / Ti and K Td per tick: PWM steps for a speed error of one count per window."""
        tick_s = 1.0 / self.control.tick_hz
        error_unit_deg_s = 360.0 / float(self.counts_per_turn) / (self.control.speed_window_ticks * tick_s)
        gain = gains.proportional_duty_s_deg * self.driver.duty_max * error_unit_deg_s
        return gain, gain * tick_s / gains.integral_time_s, gain * gains.derivative_time_s / tick_s

    def with_serial(self, **changes: int | bool | None) -> Self:
        """Return this table with other serial settings. A setting that is None is not changed.

        Raises:
            ConfigError: a setting is outside its range.
        """
        chosen = {key: value for key, value in changes.items() if value is not None}
        given = TomlTable("serial settings", chosen, "serial.", ConfigError)
        return replace(self, serial=section(SerialConfig, given, asdict(self.serial)))


def load_config(path: str | Path | None = None) -> TableConfig:
    """Read a table's constants: the default values, with those of the file at `path` in their place.

    Raises:
        ConfigError: the file cannot be read, or a key, a type, a range or a combination is wrong.
    """
    default = TomlTable(DEFAULT_FILE.name, {}, error=ConfigError)
    top = default if path is None else TomlTable.load(Path(path), ConfigError)
    config = section(TableConfig, top, read_toml(DEFAULT_FILE), faults=_faults(top))
    _check_together(config, str(top.file))
    return config


def _faults(top: TomlTable) -> tuple[Fault, ...]:
    """Return the faults of `[[faults]]`: each has its name in the key `fault`, and its numbers beside it."""
    entries = [dict(entry.values) for entry in top.tables("faults")]
    try:
        return tuple(fault_from(entry.pop("fault", None), entry) for entry in entries)
    except FaultError as error:
        raise ConfigError(f"{top.file}: faults: {error}") from error


def _check_together(config: TableConfig, source: str) -> None:
    for name in ("speed_deg_s", "acceleration_deg_s2"):
        start, limit = getattr(config.power_on, name), getattr(config.limits, name)
        if start > limit:
            raise ConfigError(f"{source}: power_on.{name} is {start:g}; it must be at most limits.{name}, {limit:g}")
    _check_turn(config, source)
    _check_registers(config, source)


def _check_turn(config: TableConfig, source: str) -> None:
    """Refuse a turn that is not a fraction of two 32-bit integers, in counts."""
    lines, counts = config.encoder.lines, config.counts_per_turn
    if counts > INT32_MAX:
        raise ConfigError(
            f"{source}: a turn is {float(counts):.3g} counts; it must be at most {INT32_MAX}; "
            "reduce encoder.lines or gears.ratio"
        )
    if max(counts.numerator, counts.denominator) > INT32_MAX:
        most = INT32_MAX // (4 * lines * ceil(config.gears.ratio))
        nearest = simplest_fraction(config.gears.ratio).limit_denominator(max(1, most))
        raise ConfigError(
            f"{source}: gears.ratio is {config.gears.ratio!r}; with encoder.lines {lines} a turn is {counts} counts, "
            f'a fraction of more than 32 bits; the nearest allowed ratio is "{nearest}"'
        )


def _check_registers(config: TableConfig, source: str) -> None:
    """Refuse values that do not fit the firmware's number formats; see `fixed_point`."""
    count_deg, tick_hz, window = config.counts_per_deg, config.control.tick_hz, config.control.speed_window_ticks
    unit, most_counts = 2.0**-config.motion_bits, float(ERROR_MAX >> ERROR_BITS)
    speeds_deg_s = (unit * tick_hz / count_deg, most_counts / window * tick_hz / count_deg)
    accelerations_deg_s2 = (unit * tick_hz**2 / count_deg, most_counts / 2 * tick_hz**2 / count_deg)
    held = (
        ("limits.speed_deg_s", config.limits.speed_deg_s, speeds_deg_s),
        ("limits.acceleration_deg_s2", config.limits.acceleration_deg_s2, accelerations_deg_s2),
        ("power_on.speed_deg_s", config.power_on.speed_deg_s, speeds_deg_s),
        ("power_on.acceleration_deg_s2", config.power_on.acceleration_deg_s2, accelerations_deg_s2),
        ("settling.approach_speed_deg_s", config.settling.approach_speed_deg_s, (speeds_deg_s[0], inf)),
    )
    for name, value, (least, most) in held:
        if not least <= value <= most:
            bound, remedy = (f"at least {least:g}", _FINER) if value < least else (f"at most {most:g}", _COARSER)
            raise ConfigError(
                f"{source}: {name} is {value:g}; with this encoder, gear ratio and tick the firmware holds {bound}; "
                f"{remedy} extends its range"
            )
    for name in ("ramp", "hold"):
        gains = getattr(config.gains, name)
        try:
            gain_registers(*config.gains_per_tick(gains))
        except OverflowError as error:
            raise ConfigError(f"{source}: gains.{name}: {gains} does not fit the firmware: {error}") from None
