"""Replies that a client has not read yet: whole lines, up to a limit."""

from collections.abc import Callable

LIMIT_BYTES = 65536
"""The limit of this queue, in addition to the buffer of the system. No line starts beyond it."""

_LINE_END = b"\r"


class Outbox:
    """A queue that drops unread bytes in whole lines, so that the rest is still one reply per line.

    Attributes:
        dropped_bytes: number of bytes dropped since the last `clear`.
    """

    def __init__(self) -> None:
        self.dropped_bytes = 0
        self._held = bytearray()
        self._dropping = False
        self._at_line_start = True

    def __bool__(self) -> bool:
        return bool(self._held)

    def put(self, data: bytes) -> None:
        """Queue bytes, which may start and end within a line."""
        for piece in data.splitlines(keepends=True):
            if self._at_line_start:
                self._dropping = len(self._held) >= LIMIT_BYTES
            elif len(self._held) >= 2 * LIMIT_BYTES:
                self._dropping = True  # Garbage from a wrong baud rate has no lines.
            if self._dropping:
                self.dropped_bytes += len(piece)
            else:
                self._held += piece
            self._at_line_start = piece.endswith(_LINE_END)

    def put_whole(self, data: bytes) -> None:
        """Queue bytes that belong together and are not a line."""
        if len(self._held) < 2 * LIMIT_BYTES:
            self._held += data

    def flush(self, send: Callable[[bytes], int]) -> None:
        """Pass bytes to `send`, which returns how many it took, until it raises BlockingIOError."""
        try:
            while self._held:
                del self._held[: send(bytes(self._held))]
        except BlockingIOError:
            return

    def clear(self) -> None:
        """Discard everything: the next byte starts a line, for another client."""
        self._held.clear()
        self.dropped_bytes = 0
        self._dropping = False
        self._at_line_start = True
