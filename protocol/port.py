"""The interface of a serial port that the client needs: a part of pyserial's."""

from typing import Protocol


class Port(Protocol):
    """An open pyserial port, or an object that behaves like one."""

    timeout: float | None
    """The maximum time that `read` waits, in seconds."""

    @property
    def in_waiting(self) -> int:
        """The number of bytes that can be read without waiting; some ports report only 0 or 1."""
        ...

    def read(self, size: int, /) -> bytes:
        """Return `size` bytes, or fewer after `timeout`."""
        ...

    def write(self, data: bytes, /) -> int | None:
        """Send all of `data`."""
        ...

    def close(self) -> None:
        """Close the port."""
        ...
