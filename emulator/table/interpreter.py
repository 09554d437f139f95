"""The command interpreter: the effect of each verb of Table 1 on the controller, and its reply."""

from collections.abc import Callable
from decimal import Decimal
from fractions import Fraction
from typing import NamedTuple

from emulator.config.gear_ratio import simplest_fraction
from emulator.config.table_config import TableConfig
from emulator.firmware.controller import FirmwareState, begin_motion, distance_to
from emulator.firmware.fixed_point import to_fixed
from emulator.firmware.profiler import Profile
from emulator.int32 import INT32_MAX
from protocol.messages import Angle, Command, ErrorCode, Ok, Refusal, Reply, Verb


class Registers(NamedTuple):
    """The settings for the next motion command, and the latch."""

    speed: int  # count/tick, the table's motion bits
    acceleration: int  # count/tick^2, the table's motion bits
    latched_count: int


Outcome = tuple[Reply, FirmwareState, Registers]
"""The reply to a command, and controller and registers after the command."""


class Interpreter:
    """Executes commands on a controller's state. It has no state itself."""

    def __init__(self, config: TableConfig) -> None:
        """Store the units and limits of a configured table."""
        limits, power_on = config.limits, config.power_on
        # As they are written in the file: the nearest float of 33.3 is below it, and would refuse `S 33.3`.
        self._speed_limit = simplest_fraction(limits.speed_deg_s)
        self._acceleration_limit = simplest_fraction(limits.acceleration_deg_s2)
        self._first_speed = simplest_fraction(power_on.speed_deg_s)
        self._first_acceleration = simplest_fraction(power_on.acceleration_deg_s2)
        self._count_deg = config.counts_per_turn / 360
        self._bits = config.motion_bits
        self._last_position = INT32_MAX << self._bits
        self._half_range = (INT32_MAX + 1) << self._bits  # the longest motion; and, negated, the first position
        self._tick_hz = config.control.tick_hz

    def power_on(self) -> Registers:
        """Return the registers at power-on; the latch holds the position at power-on."""
        return Registers(self._speed(self._first_speed), self._acceleration(self._first_acceleration), 0)

    def angle_deg(self, count: int) -> Decimal:
        """Return the angle of a count, with so many digits that rounding it once more rounds the exact angle."""
        angle = count / self._count_deg
        return Decimal(angle.numerator) / angle.denominator

    def execute(self, command: Command, controller: FirmwareState, registers: Registers) -> Outcome:
        """Return the reply, and controller and registers after the command. A refused command changes nothing.

        A verb without an entry in `CARRIED_OUT` is refused as unknown.
        """
        if command.verb not in CARRIED_OUT:
            return Refusal(ErrorCode.UNKNOWN_COMMAND), controller, registers
        return CARRIED_OUT[command.verb](self, command, controller, registers)

    def read_position(self, command: Command, controller: FirmwareState, registers: Registers) -> Outcome:
        """H: the angle of the encoder's last count."""
        return Angle(command.verb, self.angle_deg(controller.counts[-1])), controller, registers

    def read_latch(self, command: Command, controller: FirmwareState, registers: Registers) -> Outcome:
        """L: the angle of the count that the trigger latched."""
        return Angle(command.verb, self.angle_deg(registers.latched_count)), controller, registers

    def move_to(self, command: Command, controller: FirmwareState, registers: Registers) -> Outcome:
        """P: start a motion to a position within the range of the counter."""
        target = to_fixed(_value(command) * self._count_deg, self._bits)
        if not -self._half_range <= target <= self._last_position:
            return Refusal(ErrorCode.OUT_OF_RANGE), controller, registers
        return self._move(distance_to(controller.reference, target, self._bits), controller, registers)

    def move_by(self, command: Command, controller: FirmwareState, registers: Registers) -> Outcome:
        """R: start a motion by an increment."""
        return self._move(to_fixed(_value(command) * self._count_deg, self._bits), controller, registers)

    def set_speed(self, command: Command, controller: FirmwareState, registers: Registers) -> Outcome:
        """S: the maximum speed of the next motion."""
        value = _value(command)
        speed = self._speed(value)
        if speed < 1 or value > self._speed_limit:
            return Refusal(ErrorCode.OUT_OF_RANGE), controller, registers
        return Ok(), controller, registers._replace(speed=speed)

    def set_acceleration(self, command: Command, controller: FirmwareState, registers: Registers) -> Outcome:
        """A: the acceleration of the next motion."""
        value = _value(command)
        acceleration = self._acceleration(value)
        if acceleration < 1 or value > self._acceleration_limit:
            return Refusal(ErrorCode.OUT_OF_RANGE), controller, registers
        return Ok(), controller, registers._replace(acceleration=acceleration)

    def _move(self, distance: int, controller: FirmwareState, registers: Registers) -> Outcome:
        if abs(distance) > self._half_range:
            return Refusal(ErrorCode.OUT_OF_RANGE), controller, registers
        profile = Profile.of(registers.speed, registers.acceleration)
        return Ok(), begin_motion(controller, profile, distance, self._bits), registers

    def _speed(self, speed_deg_s: Fraction) -> int:
        return to_fixed(speed_deg_s * self._count_deg / self._tick_hz, self._bits)

    def _acceleration(self, acceleration_deg_s2: Fraction) -> int:
        return to_fixed(acceleration_deg_s2 * self._count_deg / self._tick_hz**2, self._bits)


def _value(command: Command) -> Fraction:
    assert command.value is not None, command  # the codec gives a number to each verb that takes one
    return Fraction(command.value)


CARRIED_OUT: dict[Verb, Callable[[Interpreter, Command, FirmwareState, Registers], Outcome]] = {
    Verb.READ_POSITION: Interpreter.read_position,
    Verb.READ_LATCH: Interpreter.read_latch,
    Verb.MOVE_TO: Interpreter.move_to,
    Verb.MOVE_BY: Interpreter.move_by,
    Verb.SET_SPEED: Interpreter.set_speed,
    Verb.SET_ACCELERATION: Interpreter.set_acceleration,
}
"""The action of each verb; a test checks that all verbs are present."""
