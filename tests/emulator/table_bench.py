"""A table with an unpaced line, and common actions of tests."""

from collections.abc import Iterator

from emulator.config.table_config import load_config
from emulator.table.table import Table
from protocol.bench import TableStatus

PACED = load_config()
UNPACED = PACED.with_serial(baud=0, decimals=6)
REST_DEG = 0.05


def ask(table: Table, *lines: str) -> bytes:
    """Send lines on an unpaced line and return what is answered at once."""
    table.receive("".join(f"{line}\r" for line in lines).encode())
    return table.transmit()


def move(table: Table, *lines: str) -> TableStatus:
    """Send lines and wait until the table stands; they must all be accepted."""
    assert set(ask(table, *lines).split()) == {b"OK"}
    return until_at_rest(table)


def until_at_rest(table: Table) -> TableStatus:
    for _ in range(1000):
        table.advance(100)
        if table.status().state in {"idle", "stalled"}:
            table.advance(100)  # let the motor stop
            return table.status()
    raise AssertionError(f"still on its way: {table.status()}")


def statuses(table: Table, ticks: int) -> Iterator[TableStatus]:
    for _ in range(ticks):
        table.advance(1)
        yield table.status()
