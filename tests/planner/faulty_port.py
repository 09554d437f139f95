"""A port onto a simulated table that fails at a chosen time."""

from collections.abc import Callable

from emulator.protocol_emulator import Serial
from protocol import Clock

Fault = Callable[[bytes], bytes]


def hang_up(_: bytes) -> bytes:
    """The line has failed."""
    raise OSError(5, "Input/output error")


def lose(_: bytes) -> bytes:
    """The received bytes are lost."""
    return b""


class FaultyPort:
    """The port of a table in virtual time; each read from `fault_s` on uses `fault`.

    Attributes:
        table: the simulated table.
        clock: its time, or a replacement by a test.
    """

    def __init__(
        self, fault: Fault | None = None, fault_s: float = 0.0, faults: int = 1_000_000, url: str = "emulator://"
    ) -> None:
        self._port = Serial(url, baudrate=9600, timeout=0.5, write_timeout=0.5)
        self._fault, self._fault_s, self._faults = fault, fault_s, faults
        self.table = self._port.table
        self.clock: Clock = self._port.clock

    @property
    def timeout(self) -> float | None:
        return self._port.timeout

    @timeout.setter
    def timeout(self, timeout_s: float | None) -> None:
        self._port.timeout = timeout_s

    @property
    def in_waiting(self) -> int:
        return self._port.in_waiting

    def read(self, size: int, /) -> bytes:
        data = self._port.read(size)
        if self._fault is None or not data or self.clock.now_s() < self._fault_s or not self._faults:
            return data
        self._faults -= 1
        return self._fault(data)

    def write(self, data: bytes, /) -> int:
        return self._port.write(data)

    def close(self) -> None:
        self._port.close()
