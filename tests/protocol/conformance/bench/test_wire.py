"""Lines and silence on the wire, from slow tables and from devices that are not a table."""

from collections.abc import Iterator
from itertools import cycle

import pytest

from protocol.conformance.bench.host_watch import Punctual
from protocol.conformance.bench.ports import SessionError
from protocol.conformance.bench.wire import RecordedPort, Wire
from protocol.conformance.profile.profile import load_profile
from protocol.conformance.session.first_contact import resting_position
from tests.protocol.conformance.ideal_table import SimulatedClock


class Bytes:
    """A port that receives bytes at given times, in simulated time."""

    def __init__(self, coming: Iterator[tuple[float, bytes]]) -> None:
        self.clock = SimulatedClock()
        self.timeout: float | None = 0.0
        self.sent = b""
        self._coming = coming
        self._next = next(coming, None)

    @property
    def in_waiting(self) -> int:
        return int(self._next is not None and self._next[0] <= self.clock.time_s)

    def read(self, _: int, /) -> bytes:
        end_s = self.clock.time_s + (self.timeout or 0.0)
        if self._next is None or self._next[0] > end_s:
            self.clock.time_s = end_s
            return b""
        time_s, byte = self._next
        self.clock.time_s = max(self.clock.time_s, time_s)
        self._next = next(self._coming, None)
        return byte

    def write(self, data: bytes, /) -> int:
        self.sent += data
        return len(data)

    def open(self) -> None:
        pass

    def close(self) -> None:
        pass


def wire_with(*coming: tuple[float, bytes], byte_s: float = 0.0) -> Wire:
    return Wire(RecordedPort(Bytes(iter(coming))), byte_s)


class Flood(Bytes):
    """A device that sends without end, faster than the kit reads."""

    def __init__(self, data: bytes) -> None:
        super().__init__(iter(()))
        self._data = cycle(data)

    def read(self, _: int, /) -> bytes:
        self.clock.sleep_s(1e-4)
        return bytes([next(self._data)])


def test_a_reply_is_waited_for_from_the_end_of_its_command_on() -> None:
    wire = wire_with((1.5, b"O"), (1.6, b"K"), (1.7, b"\r"), byte_s=0.1)
    wire.send(b"P 360.125\r")
    line = wire.read_line(1.0)
    assert line is not None
    assert (line.text, line.first_s, line.last_s) == (b"OK", 1.5, 1.7)


def test_a_line_is_silent_when_nothing_has_come_for_a_while() -> None:
    wire = wire_with((0.4, b"O"), (0.8, b"K"), (1.2, b"\r"), (9.0, b"!"))
    assert wire.drain(quiet_s=0.5, patience_s=60.0) == b"OK\r"
    assert wire.clock.now_s() < 3.0


def test_a_line_that_does_not_fall_silent_is_not_waited_for_for_ever() -> None:
    wire = wire_with(*((second / 10, b".") for second in range(1000)))
    assert len(wire.drain(quiet_s=0.5, patience_s=5.0)) < 100


def test_a_flood_without_a_cr_is_no_line() -> None:
    assert Wire(RecordedPort(Flood(b"x"))).read_line(1.0) is None


def test_a_flood_is_not_heard_out() -> None:
    wire = Wire(RecordedPort(Flood(b"H 0.0\r")))
    assert wire.drain(quiet_s=0.5, patience_s=1e6)
    assert wire.clock.now_s() < 60.0


@pytest.mark.parametrize("data", [b"x", b"H 0.0\r"])
def test_a_device_that_floods_is_no_table(data: bytes) -> None:
    wire = Wire(RecordedPort(Flood(data)))
    with pytest.raises(SessionError, match=r"sends without a command: b'.{,60}'...; this is not a table"):
        resting_position(wire, load_profile(), Punctual())


def test_what_whoever_was_there_before_did_not_read_is_no_answer() -> None:
    old = b"ERR 5 bad byte\rH 7.0\r"
    wire = wire_with(*((0.2 + index / 100, bytes([byte])) for index, byte in enumerate(old)))
    with pytest.raises(SessionError, match="no reply to 'H' within 1 s"):
        resting_position(wire, load_profile(), Punctual())
