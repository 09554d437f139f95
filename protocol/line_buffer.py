"""Split a stream of bytes into lines, in bounded memory."""

from protocol.messages import LINE_LIMIT, ErrorCode

_PRINTABLE = bytes(range(0x20, 0x7F))


class LineBuffer:
    """Splits a stream of bytes into lines, with one result for each line that is not empty.

    A line ends with CR; LF is ignored everywhere. A line of spaces alone is empty. A faulty line gives its first fault
    instead of its bytes. The result does not depend on how the stream was split.
    """

    def __init__(self, limit: int = LINE_LIMIT) -> None:
        """Start at the beginning of a line with at most `limit` bytes."""
        self._limit = limit
        self._line = b""
        self._fault: ErrorCode | None = None

    def feed(self, data: bytes) -> list[bytes | ErrorCode]:
        """Return the lines that end within `data`, in order, without their CR."""
        *ends, beginning = data.translate(None, b"\n").split(b"\r")
        finished = []
        for end in ends:
            self._append(end)
            line = self._line if self._fault is None else self._fault
            self.discard()
            if isinstance(line, ErrorCode) or line.strip(b" "):
                finished.append(line)
        self._append(beginning)
        return finished

    def discard(self) -> None:
        """Discard the present incomplete line: its client has disconnected."""
        self._line = b""
        self._fault = None

    def spoil(self) -> None:
        """Record that bytes of the present line were lost: it must not count as complete."""
        if self._fault is None:
            self._fault = ErrorCode.BAD_BYTE

    def _append(self, part: bytes) -> None:
        if self._fault is not None or not part:
            return
        room = self._limit - len(self._line)
        if part[:room].translate(None, _PRINTABLE):
            self._fault = ErrorCode.BAD_BYTE
        elif len(part) > room:
            self._fault = ErrorCode.LINE_TOO_LONG
        else:
            self._line += part
