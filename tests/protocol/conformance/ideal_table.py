"""A conforming third-party table: written from docs/protocol.md alone, in closed form, without code of the emulator.

Its motor follows the reference at once; its encoder is coarse. Each test sets the speed of its replies.
"""

import math
import re
from dataclasses import dataclass, field
from fractions import Fraction

from protocol.conformance.bench.stand import POWER_CYCLE, PRESET, TRIGGER, Stand

_COMMAND = re.compile(rb"([HL]) *|([PRSA]) *([+-]?[0-9]+(?:\.[0-9]+)?) *")
_WORDS = ("unknown command", "bad number", "out of range", "line too long", "bad byte")
_BUFFER_BYTES, _LINE_BYTES = 64, 32
_LEAST_SETTING = Fraction(1, 1000)


@dataclass(frozen=True)
class Make:
    """The differences between these tables."""

    counts_per_deg: int = 20
    decimals: int = 3
    top_speed: float = 25.0
    top_acceleration: float = 60.0
    error_replies: bool = False
    baud: int = 9600
    latency_s: float = 0.08
    """Time from the CR of a command to the first byte of its reply."""
    profile_latency_s: float | None = None
    """The values of the profile, if they differ from the true ones."""
    acts_after: float = 0.5
    """The share of the latency after which the command is executed."""
    reply_end: bytes = b"\r"
    is_busy_meanwhile: bool = False
    """Whether a line waits in the buffer until the previous one has its reply."""

    @property
    def profile(self) -> str:
        """The profile of its manufacturer."""
        return f"""
            [table]
            counts_per_deg = {self.counts_per_deg}
            [serial]
            baud = {self.baud}
            decimals = {self.decimals}
            error_replies = {str(self.error_replies).lower()}
            latency_s = {self.profile_latency_s or max(self.latency_s, 0.01)}
            timeout_s = {3.0 if self.baud == 300 else 1.0}
            [limits]
            speed_deg_s = {self.top_speed}
            acceleration_deg_s2 = {self.top_acceleration}
            [power_on]
            speed_deg_s = {self.top_speed / 4}
            acceleration_deg_s2 = {self.top_acceleration / 4}
            [motion]
            speed_deg_s = {self.top_speed}
            acceleration_deg_s2 = {self.top_acceleration}
        """


class Move:
    """A motion at constant accelerations from a position and a speed to rest at a target."""

    def __init__(self, start_s: float, start: float, speed: float, target: float, top: float, rate: float) -> None:
        self.start_s, self.start, self.speed, self.target = start_s, start, speed, target
        self.legs: list[tuple[float, float]] = []
        stop = start + speed * abs(speed) / (2 * rate)
        if speed and (target - stop) * speed <= 0:
            self.legs.append((abs(speed) / rate, -math.copysign(rate, speed)))
            start, speed = stop, 0.0
        way, speed = target - start, abs(speed)
        if way:
            peak = min(top, math.sqrt(rate * abs(way) + speed**2 / 2))
            first_s, last_s = abs(peak - speed) / rate, peak / rate
            between = abs(way) - (peak + speed) / 2 * first_s - peak / 2 * last_s
            forwards = math.copysign(1.0, way)
            first_rate = rate if peak > speed else -rate
            self.legs += [(first_s, forwards * first_rate), (max(between, 0.0) / peak, 0.0), (last_s, -forwards * rate)]

    def at(self, time_s: float) -> tuple[float, float]:
        """Return position and speed."""
        left_s, position, speed = time_s - self.start_s, self.start, self.speed
        for leg_s, rate in self.legs:
            step_s = min(left_s, leg_s)
            position += speed * step_s + rate * step_s**2 / 2
            speed += rate * step_s
            left_s -= step_s
            if left_s <= 0:
                return position, speed
        return self.target, 0.0


class IdealTable(Stand):
    """The registers and the commands; also the actions of the bench."""

    capabilities = frozenset({TRIGGER, POWER_CYCLE, PRESET})

    def __init__(self, make: Make) -> None:
        self.make = make
        self.now_s = 0.0
        self.preset(0)

    def trigger(self) -> None:
        self.latch = self.count(self.now_s)

    def power_cycle(self) -> None:
        self.preset(0)

    def preset(self, count: int) -> None:
        self.latch = count
        self.top, self.rate = self.make.top_speed / 4, self.make.top_acceleration / 4
        angle = count / self.make.counts_per_deg
        self.move = Move(self.now_s, angle, 0.0, angle, 1.0, 1.0)

    def count(self, time_s: float) -> int:
        return (round(self.move.at(time_s)[0] * self.make.counts_per_deg) + 2**31) % 2**32 - 2**31

    def reply_to(self, line: bytes, time_s: float) -> str | int:
        """Execute a line at a time; return its reply, or the number of its error."""
        if line[:1] not in {b"H", b"L", b"P", b"R", b"S", b"A"}:
            return 1
        found = _COMMAND.fullmatch(line)
        if found is None:
            return 2
        if found[1]:
            return self._angle(found[1].decode(), self.count(time_s) if found[1] == b"H" else self.latch)
        letter, number = found[2], Fraction(found[3].decode())
        if letter in {b"S", b"A"}:
            return self._set(letter, number)
        return self._go(number, time_s, relative=letter == b"R")

    def _angle(self, letter: str, count: int) -> str:
        unit = 10**self.make.decimals
        units = round(Fraction(count * unit, self.make.counts_per_deg))  # halves to the even one
        whole, rest = divmod(abs(units), unit)
        return f"{letter} {'-' if units < 0 else ''}{whole}.{rest:0{self.make.decimals}d}"

    def _set(self, letter: bytes, number: Fraction) -> str | int:
        limit = self.make.top_speed if letter == b"S" else self.make.top_acceleration
        if not _LEAST_SETTING <= number <= Fraction(limit):
            return 3
        if letter == b"S":
            self.top = float(number)
        else:
            self.rate = float(number)
        return "OK"

    def _go(self, number: Fraction, time_s: float, relative: bool) -> str | int:
        end = Fraction(2**31, self.make.counts_per_deg)
        position, speed = self.move.at(time_s)
        target = float(number) + (position if relative else 0.0)
        if (not relative and not -end <= number < end) or abs(target - position) > end:
            return 3
        self.move = Move(time_s, position, speed, target, self.top, self.rate)
        return "OK"


@dataclass
class SimulatedClock:
    """Time that passes only while a program waits."""

    time_s: float = 0.0

    def now_s(self) -> float:
        return self.time_s

    def sleep_s(self, duration_s: float) -> None:
        self.time_s += max(duration_s, 0.0)


@dataclass
class IdealPort:
    """The serial line of such a table, as pyserial gives it, in simulated time."""

    table: IdealTable
    clock: SimulatedClock = field(default_factory=SimulatedClock)
    timeout: float | None = 1.0

    def __post_init__(self) -> None:
        make = self.table.make
        self._byte_s = 10 / make.baud if make.baud else 0.0
        self._arrived_s = self._free_s = self._said_s = 0.0
        self._unread: list[float] = []
        self._out: list[tuple[float, int]] = []
        self._forget_line()

    @property
    def in_waiting(self) -> int:
        return sum(time_s <= self.clock.time_s for time_s, _ in self._out)

    def read(self, size: int, /) -> bytes:
        end_s, data = self.clock.time_s + (self.timeout or 0.0), b""
        while len(data) < size and self._out and self._out[0][0] <= end_s:
            time_s, byte = self._out.pop(0)
            self.clock.time_s = max(self.clock.time_s, time_s)
            data += bytes([byte])
        if len(data) < size:
            self.clock.time_s = end_s
        self.table.now_s = self.clock.time_s
        return data

    def write(self, data: bytes, /) -> int:
        for byte in data:
            self._arrived_s = max(self._arrived_s, self.clock.time_s) + self._byte_s
            self._receive(byte, self._arrived_s)
        self.table.now_s = self.clock.time_s
        return len(data)

    def open(self) -> None:
        pass

    def close(self) -> None:
        self._forget_line()
        self._out.clear()

    def _forget_line(self) -> None:
        self._line, self._fault = b"", 0

    def _receive(self, byte: int, time_s: float) -> None:
        self._unread = [looked_s for looked_s in self._unread if looked_s > time_s]
        if len(self._unread) >= _BUFFER_BYTES:
            self._fault = self._fault or 5
            return
        if self.table.make.is_busy_meanwhile:
            self._unread.append(max(time_s, self._free_s))
        if byte == 0x0D:
            line, fault = self._line, self._fault
            self._forget_line()
            if fault or line.strip(b" "):
                self._answer(line, fault, max(time_s, self._free_s))
        elif byte != 0x0A and not self._fault:
            self._line += bytes([byte])
            self._fault = 4 if len(self._line) > _LINE_BYTES else 0 if 0x20 <= byte <= 0x7E else 5

    def _answer(self, line: bytes, fault: int, time_s: float) -> None:
        make = self.table.make
        reply = fault or self.table.reply_to(line, time_s + make.acts_after * make.latency_s)
        if make.is_busy_meanwhile:
            self._free_s = time_s + make.latency_s
        if isinstance(reply, int):
            if not make.error_replies:
                return
            reply = f"ERR {reply} {_WORDS[reply - 1]}"
        self._said_s = max(time_s + make.latency_s, self._said_s)
        for byte in reply.encode() + make.reply_end:
            self._said_s += self._byte_s
            self._out.append((self._said_s, byte))
