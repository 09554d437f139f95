"""What the client needs of a serial port: a part of pyserial's interface."""

from typing import Protocol


class Port(Protocol):
    """An open pyserial port, or anything that behaves like one."""

    timeout: float | None
    """How long `read` waits, in seconds."""

    @property
    def in_waiting(self) -> int:
        """The number of bytes that can be read at once; some ports say only 0 or 1."""
        ...

    def read(self, size: int, /) -> bytes:
        """Return `size` bytes, or fewer when `timeout` has passed."""
        ...

    def write(self, data: bytes, /) -> int | None:
        """Send all of `data`."""
        ...

    def close(self) -> None:
        """Give the port back."""
        ...
