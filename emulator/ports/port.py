"""What a way in to the table is to the server: bytes both ways, and clients that come and go."""

from typing import Final, NamedTuple, Protocol

_BAD_BYTE: Final = b"\x18"  # CAN, as in clause 8.3/1 of the protocol
_HARMLESS: Final = (b"", b"H", b"L")
"""Lines that change nothing."""


class Arrival(NamedTuple):
    """What clients did since the last look.

    `left_before` and `left_after` say that a client went away before or after `data` was sent: a half line that it
    left behind ends there. `is_doubtful` says that the bytes are of several clients and that nobody can tell where
    those of one end: none of their lines may set or move anything.
    """

    left_before: bool = False
    data: bytes = b""
    left_after: bool = False
    is_doubtful: bool = False


def spoiled(data: bytes) -> bytes:
    """Return bytes whose lines change nothing: each that does more than read is refused for a bad byte."""
    return b"\r".join(line if line in _HARMLESS else _BAD_BYTE + line for line in data.split(b"\r"))


def changes_nothing(data: bytes) -> bool:
    """Return whether all lines of some bytes only read, so that nothing of them is refused when they are spoiled."""
    return all(line.replace(_BAD_BYTE, b"") in _HARMLESS for line in data.split(b"\r"))


class Port(Protocol):
    """One way in to the table. Nothing here blocks."""

    name: str
    """What a client opens."""

    @property
    def client_count(self) -> int:
        """Clients that are there, as of the last `receive`."""
        ...

    @property
    def input_descriptors(self) -> tuple[int, ...]:
        """What becomes readable when `receive` has something to return."""
        ...

    @property
    def output_descriptors(self) -> tuple[int, ...]:
        """What becomes writable when `flush` can do something; empty when there is nothing to flush."""
        ...

    def receive(self) -> Arrival:
        """Return what clients did since the last call."""
        ...

    def send(self, data: bytes) -> None:
        """Give bytes to the client; what it does not take is lost in the end, as on a wire."""
        ...

    def flush(self) -> None:
        """Give the client more of what it has not taken yet."""
        ...

    def hang_up(self) -> None:
        """Go away, as an adapter that is pulled out."""
        ...

    def come_back(self) -> None:
        """Be there again after `hang_up`."""
        ...

    def close(self) -> None:
        """Give everything back to the system."""
        ...
