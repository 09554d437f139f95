"""The interface of a port to the server: bytes in both directions, and clients that connect and disconnect."""

from typing import Final, NamedTuple, Protocol

_BAD_BYTE: Final = b"\x18"  # CAN, as in clause 8.3/1 of the protocol
_HARMLESS: Final = (b"", b"H", b"L")
"""Lines that change nothing."""


class Arrival(NamedTuple):
    """The actions of clients since the last look.

    `left_before` and `left_after` state that a client disconnected before or after `data` was sent: its incomplete line
    ends there. `is_doubtful` states that the bytes are from several clients and that the boundary is unknown: none of
    their lines may set or move anything.
    """

    left_before: bool = False
    data: bytes = b""
    left_after: bool = False
    is_doubtful: bool = False


def spoiled(data: bytes) -> bytes:
    """Return bytes whose lines change nothing: each line that does more than read is refused because of a bad byte."""
    return b"\r".join(line if line in _HARMLESS else _BAD_BYTE + line for line in data.split(b"\r"))


def changes_nothing(data: bytes) -> bool:
    """Return whether all lines of some bytes only read, so that none of them is refused when they are spoiled."""
    return all(line.replace(_BAD_BYTE, b"") in _HARMLESS for line in data.split(b"\r"))


class Port(Protocol):
    """One port of the table. Its methods do not block."""

    name: str
    """The name that a client opens."""

    @property
    def client_count(self) -> int:
        """Number of connected clients, as of the last `receive`."""
        ...

    @property
    def input_descriptors(self) -> tuple[int, ...]:
        """Descriptors that become readable when `receive` has something to return."""
        ...

    @property
    def output_descriptors(self) -> tuple[int, ...]:
        """Descriptors that become writable when `flush` can send; empty when there is nothing to flush."""
        ...

    def receive(self) -> Arrival:
        """Return the actions of clients since the last call."""
        ...

    def send(self, data: bytes) -> None:
        """Send bytes to the client. Bytes that it does not read are lost in the end, as on a serial line."""
        ...

    def flush(self) -> None:
        """Send more of the bytes that the client has not read yet."""
        ...

    def hang_up(self) -> None:
        """Disappear, as an adapter that is unplugged."""
        ...

    def come_back(self) -> None:
        """Reappear after `hang_up`."""
        ...

    def close(self) -> None:
        """Release all resources of the system."""
        ...
