"""A table in virtual time with its port and its client, for fault injection."""

from emulator.faults.fault import fault_from
from emulator.protocol_emulator import Serial
from protocol import TableClient


class Bench:
    """A table, its port, and a client that has resynchronized."""

    def __init__(self, url: str = "emulator://") -> None:
        self.port = Serial(url, timeout=1)
        self.table = self.port.table
        self.client = TableClient(self.port)
        self.client.position_deg()

    def inject(self, kind: str, **numbers: float) -> None:
        self.table.inject(fault_from(kind, numbers))

    def move(self, angle_deg: float, seconds: float = 5.0) -> None:
        self.client.set_speed(20)
        self.client.move_to(angle_deg)
        self.client.clock.sleep_s(seconds)

    def raw(self, line: bytes, seconds: float = 0.3) -> bytes:
        self.port.write(line + b"\r")
        self.client.clock.sleep_s(seconds)
        return self.port.read(self.port.in_waiting)
