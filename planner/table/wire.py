"""The properties of the serial line: which numbers can be sent, and the transmission time."""

import math
from decimal import Decimal
from typing import NamedTuple

from planner.errors import PlannerError
from planner.table.motion import Limits
from protocol import Command, Ok, Verb, encode_command, encode_reply
from protocol.trapezoid import MotionCommand


class StreamError(PlannerError):
    """A motion that cannot be sent to the table as commands."""


class Wire(NamedTuple):
    """The serial line for the commands.

    Attributes:
        decimals: decimal places.
        baud: 10 bits per byte; 0 if bytes take no time.
        turnaround_s: time from the end of a command to the start of the next, in addition to the transmission time: the
            delays of driver, adapter and operating system.
        latency_s: time from the arrival of a CR to its effect: a tick of the firmware, and clocks with a resolution of
            one tick.
    """

    decimals: int = 1
    baud: int = 9600
    turnaround_s: float = 0.002
    latency_s: float = 0.0015

    @property
    def quantum(self) -> float:
        """The resolution of the numbers."""
        return float(10.0**-self.decimals)

    def seconds(self, byte_count: int) -> float:
        """Return the transmission time of bytes."""
        return 10.0 * byte_count / self.baud if self.baud else 0.0


def exchanges_s(wire: Wire, command: MotionCommand, before: MotionCommand | None = None) -> float:
    """Return the time for the commands of one step with their replies, and for the reading of the latch.

    An S or an A that equals that of `before` is not sent again.
    """
    lines = [encode_command(Command(Verb.READ_LATCH)), command_line(Verb.MOVE_TO, command.target_deg, wire)]
    if before is None or command.speed_deg_s != before.speed_deg_s:
        lines.append(command_line(Verb.SET_SPEED, command.speed_deg_s, wire))
    if before is None or command.acceleration_deg_s2 != before.acceleration_deg_s2:
        lines.append(command_line(Verb.SET_ACCELERATION, command.acceleration_deg_s2, wire))
    # The reply to the latch command has an angle about as long as P's own line; the others are OK.
    replies = len(lines[1]) + (len(lines) - 1) * len(encode_reply(Ok()))
    return wire.seconds(sum(map(len, lines)) + replies) + wire.turnaround_s * len(lines)


def command_line(verb: Verb, value: float, wire: Wire) -> bytes:
    """Return a command with rounded numbers, as transmitted."""
    return encode_command(Command(verb, Decimal(repr(value))), wire.decimals)


class Grid:
    """The numbers that can be transmitted, within the limits.

    Attributes:
        quantum: the resolution of the numbers.
    """

    def __init__(self, limits: Limits, wire: Wire) -> None:
        """Use the numbers of `wire`; StreamError if none is within the limits."""
        self.quantum = wire.quantum
        self._decimals = wire.decimals
        self._most_speed = self._whole(limits.speed_deg_s)
        self._most_rate = self._whole(limits.acceleration_deg_s2)
        if not (self._most_speed and self._most_rate):
            raise StreamError(
                f"the table's limits are {limits.speed_deg_s:g} deg/s and {limits.acceleration_deg_s2:g} deg/s2;"
                f" with {wire.decimals} decimals both must be at least {self.quantum:g}"
            )

    @property
    def limits(self) -> Limits:
        """The largest S and A that can be sent."""
        return Limits(self._number(self._most_speed), self._number(self._most_rate))

    def nearest(self, value: float) -> float:
        """Return the nearest number to a value."""
        return self._number(round(value / self.quantum))

    def speed(self, value: float) -> float:
        """Return the nearest allowed S to a speed."""
        return self._number(min(max(round(value / self.quantum), 1), self._most_speed))

    def rate(self, value: float) -> float:
        """Return the nearest allowed A to an acceleration."""
        return self._number(min(max(round(value / self.quantum), 1), self._most_rate))

    def rates_around(self, value: float) -> tuple[float, float]:
        """Return the nearest allowed A below and above an acceleration."""
        below = math.floor(min(value / self.quantum, self._most_rate))
        return self.rate(below * self.quantum), self.rate((below + 1) * self.quantum)

    def rate_at_least(self, value: float) -> float:
        """Return the smallest allowed A that is not below an acceleration; the largest one if there is none."""
        steps = value / self.quantum
        return self._number(
            min(max(math.ceil(steps - 1e-6), 1), self._most_rate) if steps < self._most_rate else self._most_rate
        )

    def speeds_around(self, speed_deg_s: float, count: int) -> list[float]:
        """Return the allowed speeds, signed and without 0, within `count` numbers of one."""
        middle = round(speed_deg_s / self.quantum)
        most = self._most_speed
        return [self._number(n) for n in range(middle - count, middle + count + 1) if n and -most <= n <= most]

    def beyond(self, angle_deg: float, forward: float) -> float:
        """Return the nearest number beyond an angle, in the direction `forward` (1 or -1)."""
        return self._number(int(forward * (math.floor(forward * angle_deg / self.quantum + 1e-6) + 1)))

    def command(self, command: MotionCommand) -> MotionCommand:
        """Return the nearest command that can be transmitted."""
        target, speed, rate = command
        return MotionCommand(self.nearest(target), self.speed(speed), self.rate(rate))

    def _whole(self, limit: float) -> int:
        return math.floor(limit / self.quantum + 1e-6)

    def _number(self, n: int) -> float:
        return round(n * self.quantum, self._decimals)
