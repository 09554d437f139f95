"""A table in virtual time, with replies that a test delays, cuts or drops.

The table answers H and L with the number of lines that it has received, so a reply identifies its line.
"""

from collections import deque
from collections.abc import Callable, Iterable
from decimal import Decimal

from protocol import (
    VERBS,
    Angle,
    Command,
    ErrorCode,
    LineBuffer,
    Ok,
    Refusal,
    Reply,
    TableClient,
    decode_command,
    encode_reply,
)

Fate = Callable[[bytes], list[tuple[float, bytes]]]
"""The fate of a reply: the pieces that arrive, each with its delay in seconds beyond the table's own."""

BYTE_S = 10 / 9600
PROMPT_S = 0.001


def prompt(reply: bytes) -> list[tuple[float, bytes]]:
    return [(0.0, reply)]


def lost(_reply: bytes) -> list[tuple[float, bytes]]:
    return []


def doubled(reply: bytes) -> list[tuple[float, bytes]]:
    return [(0.0, reply + reply)]


def garbled(reply: bytes) -> list[tuple[float, bytes]]:
    return [(0.0, b"\xff" + reply[1:])]


def late(delay_s: float) -> Fate:
    return lambda reply: [(delay_s, reply)]


def cut(length: int, delay_s: float = 0.0) -> Fate:
    return lambda reply: [(delay_s, reply[:length])]


def torn(length: int, delay_s: float) -> Fate:
    return lambda reply: [(0.0, reply[:length]), (delay_s, reply[length:])]


def replaced(other: bytes) -> Fate:
    return lambda _reply: [(0.0, other)]


class VirtualClock:
    def __init__(self) -> None:
        self.time_s = 0.0

    def now_s(self) -> float:
        return self.time_s

    def sleep_s(self, duration_s: float) -> None:
        self.time_s += duration_s


class TablePort:
    """A port in virtual time with a table behind it; `fates` are those of its first replies, later ones are prompt."""

    def __init__(self, fates: Iterable[Fate] = (), *, latency_s: float = PROMPT_S, strict: bool = False) -> None:
        self.clock = VirtualClock()
        self.timeout: float | None = None
        self.is_open = True
        self.heard: list[Command | ErrorCode] = []
        self._fates = iter(fates)
        self._latency_s = latency_s
        self._strict = strict
        self._lines = LineBuffer()
        self._under_way: deque[tuple[float, int]] = deque()
        self._line_free_s = 0.0

    @property
    def in_waiting(self) -> int:
        return sum(arrival_s <= self.clock.time_s for arrival_s, _ in self._under_way)

    def read(self, size: int, /) -> bytes:
        assert self.timeout is not None, "a read without a time-out may never return"
        deadline_s = self.clock.time_s + self.timeout
        data = bytearray()
        while len(data) < size:
            if not self._under_way or self._under_way[0][0] > deadline_s:
                self.clock.time_s = deadline_s
                break
            arrival_s, byte = self._under_way.popleft()
            self.clock.time_s = max(self.clock.time_s, arrival_s)
            data.append(byte)
        return bytes(data)

    def write(self, data: bytes, /) -> int:
        for line in self._lines.feed(data):
            self._answer(decode_command(line) if isinstance(line, bytes) else line)
        return len(data)

    def close(self) -> None:
        self.is_open = False

    def _answer(self, heard: Command | ErrorCode) -> None:
        self.heard.append(heard)
        if isinstance(heard, ErrorCode) and self._strict:
            return
        for delay_s, piece in next(self._fates, prompt)(encode_reply(self._reply(heard))):
            arrival_s = self.clock.time_s + self._latency_s + delay_s
            for byte in piece:
                self._line_free_s = max(arrival_s, self._line_free_s) + BYTE_S
                self._under_way.append((self._line_free_s, byte))

    def _reply(self, heard: Command | ErrorCode) -> Reply:
        if isinstance(heard, ErrorCode):
            return Refusal(heard)
        if VERBS[heard.verb].reply is Angle:
            return Angle(heard.verb, Decimal(len(self.heard)))
        if heard.value is not None and abs(heard.value) > 1000:
            return Refusal(ErrorCode.OUT_OF_RANGE)
        return Ok()

    def give_fates(self, *fates: Fate) -> None:
        """Set the fates of the next replies; later replies are on time."""
        self._fates = iter(fates)
        self._latency_s = PROMPT_S


class MovingTablePort(TablePort):
    """A table that turns at a constant speed to its target, and stops there."""

    def __init__(self, speed_deg_s: float, target_deg: float) -> None:
        super().__init__()
        self._speed_deg_s = speed_deg_s
        self._target_deg = target_deg

    def _reply(self, heard: Command | ErrorCode) -> Reply:
        reply = super()._reply(heard)
        if not isinstance(reply, Angle):
            return reply
        return Angle(reply.verb, Decimal(min(self._target_deg, self._speed_deg_s * self.clock.time_s)))


class DeadPort(TablePort):
    def write(self, data: bytes, /) -> int:
        raise OSError(5, f"{len(data)} bytes could not be sent")


def client_in_place(port: TablePort) -> TableClient:
    """Return a client that has received its first reply."""
    client = TableClient(port)
    client.position_deg()
    return client


def last_said(port: TablePort) -> tuple[str, Decimal | None]:
    command = port.heard[-1]
    assert isinstance(command, Command)
    return command.verb, command.value
