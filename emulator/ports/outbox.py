"""Replies that a client has not taken yet: whole lines, and no more of them than is reasonable."""

from collections.abc import Callable

LIMIT_BYTES = 65536
"""What is kept here, beyond what the system keeps; no line begins beyond it."""

_LINE_END = b"\r"


class Outbox:
    """A queue that drops what nobody takes, in whole lines: what is read later is still one reply a line.

    Attributes:
        dropped_bytes: what was dropped since the last `clear`.
    """

    def __init__(self) -> None:
        self.dropped_bytes = 0
        self._held = bytearray()
        self._dropping = False
        self._at_line_start = True

    def __bool__(self) -> bool:
        return bool(self._held)

    def put(self, data: bytes) -> None:
        """Queue bytes, which may begin and end in mid-line."""
        for piece in data.splitlines(keepends=True):
            if self._at_line_start:
                self._dropping = len(self._held) >= LIMIT_BYTES
            elif len(self._held) >= 2 * LIMIT_BYTES:
                self._dropping = True  # Garbage, as of a wrong baud rate, has no lines.
            if self._dropping:
                self.dropped_bytes += len(piece)
            else:
                self._held += piece
            self._at_line_start = piece.endswith(_LINE_END)

    def put_whole(self, data: bytes) -> None:
        """Queue bytes that make sense only together, and are no line."""
        if len(self._held) < 2 * LIMIT_BYTES:
            self._held += data

    def flush(self, send: Callable[[bytes], int]) -> None:
        """Hand bytes on until `send`, which returns how many it took, raises BlockingIOError."""
        try:
            while self._held:
                del self._held[: send(bytes(self._held))]
        except BlockingIOError:
            return

    def clear(self) -> None:
        """Forget everything: the next byte begins a line, for another client."""
        self._held.clear()
        self.dropped_bytes = 0
        self._dropping = False
        self._at_line_start = True
