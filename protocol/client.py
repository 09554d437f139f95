"""The client's end of the wire: one method for each verb, waiting for arrival, and finding its place again."""

from collections import Counter, deque
from collections.abc import Callable
from contextlib import suppress
from decimal import Decimal
from types import TracebackType
from typing import Self

from protocol.clock import clock_of
from protocol.codec import decode_reply, encode_command
from protocol.errors import ArrivalTimeout, CommandRefused, PortError, ProtocolMisuse, ReplyTimeout, UnexpectedReply
from protocol.line_buffer import LineBuffer
from protocol.messages import VERBS, Angle, Command, ErrorCode, Ok, Refusal, Reply, Verb
from protocol.port import Port

POLL_INTERVAL_S = 0.05

# A half command that is left at the table must not be carried out when the next CR comes. CAN (0x18) is no printable
# byte, so it spoils whatever stands there.
_CANCEL = b"\x18\r"

_WHAT_TO_DO = {
    ErrorCode.UNKNOWN_COMMAND: "is this a table of this protocol, or is the line noisy?",
    ErrorCode.BAD_NUMBER: "the line is noisy, or the table reads numbers otherwise",
    ErrorCode.OUT_OF_RANGE: "ask for a value within the table's limits",
    ErrorCode.LINE_TOO_LONG: "a CR was lost: check the line, then send it again",
    ErrorCode.BAD_BYTE: "check baud rate and cable, then send it again",
}


class TableClient:
    """A rotary table at the other end of a port. Not for use by several threads at once.

    Leaving the `with` block closes the port; the motion that is running goes on.

    Finding the place. Replies carry no number; all that is known is that they come in order, at most one for each
    line. The client therefore sends a line only when all earlier ones are answered, and when it cannot know that (at
    the start, after a time-out, after an unexpected reply) it first makes sure, with lines that only read. Let at most
    n replies to a verb X (H or L) still be under way. Of the next n + 1 replies to X at least one then answers a line
    sent since, and all that was sent before that line is settled: answered, or never to be. So when the other verb Y
    is sent after that, the first reply to Y answers it, and Y was the last line: nothing is under way. No assumption
    about delays is made; replies may be lost, cut, garbled, or late by any time. (A table that answers a line twice
    breaks the premise; the second answer is dropped if it is there before the next line is sent.)
    """

    def __init__(self, port: Port, timeout_s: float = 1.0, decimals: int = 1) -> None:
        """Take over an open port; nothing is sent before the first command.

        Args:
            port: an open pyserial port or its like; its read time-out is set here, its `clock` is used if it has one.
            timeout_s: how long to wait for a reply.
            decimals: places after the point of the numbers sent.
        """
        self.clock = clock_of(port)
        self._port = port
        self._port.timeout = timeout_s
        self._timeout_s = timeout_s
        self._decimals = decimals
        self._lines = LineBuffer()
        self._arrived: deque[bytes | ErrorCode] = deque()
        self._last_line = "nothing"
        # An upper bound of the replies still under way. Whoever used the line before, waiting for each reply as the
        # protocol asks, left one at most.
        self._unanswered = Counter({Verb.READ_POSITION: 1, Verb.READ_LATCH: 1})

    @classmethod
    def open(cls, url: str, baud: int = 9600, timeout_s: float = 1.0, decimals: int = 1) -> Self:
        """Open a device or any pyserial URL: `/dev/ttyUSB0`, `socket://localhost:7000`, `emulator://`.

        Raises:
            PortError: the port cannot be opened.
        """
        import serial  # noqa: PLC0415 - the stand-in shares this package and starts without pyserial

        try:
            port = serial.serial_for_url(url, baudrate=baud, timeout=timeout_s, write_timeout=timeout_s)
        except (OSError, ValueError) as error:
            raise PortError(
                f"cannot open {url} at {baud} baud: {error}; check the name, the rights and the table"
            ) from error
        return cls(port, timeout_s, decimals)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        self.close()

    def close(self) -> None:
        """Close the port."""
        self._port.close()

    def position_deg(self) -> float:
        """Return the present position, as the encoder has it (H)."""
        return float(self._read(Verb.READ_POSITION))

    def latched_deg(self) -> float:
        """Return the position latched at the probe's last trigger (L)."""
        return float(self._read(Verb.READ_LATCH))

    def move_to(self, angle_deg: float | Decimal) -> None:
        """Start to move to a position on the unwrapped axis, replacing a motion that is running (P)."""
        self._exchange(Command(Verb.MOVE_TO, _decimal(angle_deg)))

    def move_by(self, angle_deg: float | Decimal) -> None:
        """Start to move by an increment to the reference position, replacing a motion that is running (R)."""
        self._exchange(Command(Verb.MOVE_BY, _decimal(angle_deg)))

    def set_speed(self, speed_deg_s: float | Decimal) -> None:
        """Set the top speed from the next motion on (S)."""
        self._exchange(Command(Verb.SET_SPEED, _decimal(speed_deg_s)))

    def set_acceleration(self, acceleration_deg_s2: float | Decimal) -> None:
        """Set the acceleration from the next motion on (A)."""
        self._exchange(Command(Verb.SET_ACCELERATION, _decimal(acceleration_deg_s2)))

    def stop(self) -> None:
        """Brake, and come back to where the table is now (R 0); sent at once even when replies are missing.

        Raises:
            TableError: as every command; the table may have heard the command all the same.
        """
        stop = Command(Verb.MOVE_BY, Decimal(0))
        if self._has_lost_its_place():
            self._write(_CANCEL)
            self._send(stop.verb, encode_command(stop))
        self._exchange(stop)

    def wait_until_at(
        self,
        angle_deg: float | Decimal,
        tolerance_deg: float | Decimal = 0.05,
        timeout_s: float = 60.0,
        progress: Callable[[float], None] | None = None,
    ) -> float:
        """Poll the position until two readings in a row are within the tolerance, and return the last.

        One reading could be that of a table which passes by.

        Args:
            angle_deg: where the table is expected.
            tolerance_deg: the greatest difference that counts as being there.
            timeout_s: how long to wait.
            progress: called with each position read.

        Raises:
            ArrivalTimeout: the table is not there in time; it is not stopped.
        """
        target, tolerance = _decimal(angle_deg), _decimal(tolerance_deg)
        deadline_s = self.clock.now_s() + timeout_s
        readings_there = 0
        while True:
            position = self._read(Verb.READ_POSITION)
            if progress is not None:
                progress(float(position))
            readings_there = readings_there + 1 if abs(position - target) <= tolerance else 0
            if readings_there == 2:
                return float(position)
            if self.clock.now_s() >= deadline_s:
                raise ArrivalTimeout(
                    f"waited {timeout_s:g} s for {target} +- {tolerance} deg, the table stands at {position} deg;"
                    " check that it was sent there and turns freely, or allow more time",
                    float(position),
                )
            self.clock.sleep_s(POLL_INTERVAL_S)

    def _read(self, verb: Verb) -> Decimal:
        reply = self._exchange(Command(verb))
        assert isinstance(reply, Angle)
        return reply.angle_deg

    def _exchange(self, command: Command) -> Angle | Ok:
        """Send a command and return its reply, which is of the kind that the verb's acceptance has."""
        sent = encode_command(command, self._decimals)
        if self._has_lost_its_place():
            self._find_place()
        self._send(command.verb, sent)
        reply = self._next_reply(sent, self.clock.now_s() + self._timeout_s)
        if not _answers(reply, command.verb):
            raise UnexpectedReply(
                f"sent {sent!r}, got {self._last_line}, which answers another command;"
                " check that no other program uses the port, then try again"
            )
        self._unanswered[command.verb] -= 1
        if isinstance(reply, Refusal):
            code = reply.code
            raise CommandRefused(f"sent {sent!r}, got ERR {code} {code.text}: {_WHAT_TO_DO[code]}", code)
        return reply

    def _has_lost_its_place(self) -> bool:
        """Tell whether the next reply could be any other than that to the next command."""
        return self._unanswered.total() > 0

    def _find_place(self) -> None:
        """Bring about that no reply is under way, as the class's docstring proves, or raise ReplyTimeout.

        The first read asks for a sign of life: while the table is silent only `other` gathers unanswered reads, and
        finding the place takes few of them however long the silence was.
        """
        self._write(_CANCEL)
        known, other = sorted((Verb.READ_POSITION, Verb.READ_LATCH), key=lambda verb: self._unanswered[verb])
        self._ask(other)
        for _ in range(self._unanswered[known] + 1):
            self._ask(known)
        self._ask(other)
        self._unanswered.clear()

    def _ask(self, verb: Verb) -> None:
        """Send a read and wait for a reply to this verb, to this line or to one before; all else is dropped."""
        sent = encode_command(Command(verb))
        self._send(verb, sent)
        deadline_s = self.clock.now_s() + self._timeout_s
        while True:
            try:
                reply = self._next_reply(sent, deadline_s)
            except UnexpectedReply:
                continue
            if isinstance(reply, Angle) and reply.verb is verb:
                self._unanswered[verb] -= 1
                return

    def _send(self, verb: Verb, line: bytes) -> None:
        """Send a command; what has come in before is no answer to it, and is dropped."""
        if self._waiting():
            self._receive()
        self._arrived.clear()
        self._lines.discard()
        self._last_line = "nothing"
        self._unanswered[verb] += 1
        self._write(line)

    def _next_reply(self, sent: bytes, deadline_s: float) -> Reply:
        """Return the next reply, or raise ReplyTimeout or UnexpectedReply."""
        while not self._arrived:
            data = self._receive() if self.clock.now_s() < deadline_s else b""
            if not data:
                raise ReplyTimeout(
                    f"sent {sent!r}, got {self._last_line}, and no reply to it within {self._timeout_s:g} s;"
                    " check power, cable and baud rate, or allow more time; whether it was carried out is unknown"
                )
            self._arrived.extend(self._lines.feed(data))
        line = self._arrived.popleft()
        self._last_line = f"a line with a fault ({line.text})" if isinstance(line, ErrorCode) else repr(line)
        if isinstance(line, bytes):
            with suppress(UnexpectedReply):
                return decode_reply(line)
        raise UnexpectedReply(
            f"sent {sent!r}, got {self._last_line}, which is no reply of the protocol; check baud rate and cable"
        )

    def _waiting(self) -> int:
        try:
            return self._port.in_waiting
        except OSError as error:
            raise self._died(error) from error

    def _receive(self) -> bytes:
        """Return what has come in, waiting for the first byte; nothing when the port's time-out has passed."""
        try:
            return self._port.read(max(1, self._port.in_waiting))
        except OSError as error:
            raise self._died(error) from error

    def _write(self, data: bytes) -> None:
        try:
            self._port.write(data)
        except OSError as error:
            raise self._died(error) from error

    @staticmethod
    def _died(error: OSError) -> PortError:
        return PortError(f"the port no longer works: {error}; check the table, then open it again")


def _answers(reply: Reply, verb: Verb) -> bool:
    if isinstance(reply, Angle):
        return reply.verb is verb
    return isinstance(reply, Refusal | VERBS[verb].reply)


def _decimal(value: float | Decimal) -> Decimal:
    """Return a number as its user wrote it: 12.35 is 12.35, not the binary fraction next to it."""
    number = value if isinstance(value, Decimal) else Decimal(repr(float(value)))
    if not number.is_finite():
        raise ProtocolMisuse(f"{value} is not a finite number")
    return number
