"""Commands and replies over a port, and resynchronization when a reply is missing."""

import logging
from collections import Counter, deque
from collections.abc import Callable, Sequence
from contextlib import suppress

from protocol.clock import clock_of
from protocol.codec import decode_command, decode_reply, encode_command
from protocol.errors import CommandRefused, PortError, ReplyTimeout, UnexpectedReply
from protocol.line_buffer import LineBuffer
from protocol.messages import LINE_LIMIT, VERBS, Angle, Command, ErrorCode, Ok, Refusal, Reply, Verb
from protocol.port import Port
from protocol.predicted_reference import PredictedReference

_log = logging.getLogger(__name__)

# An incomplete command at the table must not be executed when the next CR arrives. CAN (0x18) is not a printable byte,
# so it invalidates that line.
_CANCEL = b"\x18\r"
_CR = b"\r"
_LONGEST_READ = 2 * LINE_LIMIT

_BITS_A_BYTE = 10

_WHAT_TO_DO = {
    ErrorCode.UNKNOWN_COMMAND: "check that this is a table of this protocol, and that the line is not noisy",
    ErrorCode.BAD_NUMBER: "the line is noisy, or the table has another number format",
    ErrorCode.OUT_OF_RANGE: "use a value within the table's limits",
    ErrorCode.LINE_TOO_LONG: "a CR was lost: check the line, then send it again",
    ErrorCode.BAD_BYTE: "check baud rate and cable, then send it again",
}


class Dialogue:
    """Sends a command and returns the reply to it, never the reply to another command.

    Replies have no number. They arrive in order, at most one for each line. So a command is sent only when all earlier
    ones have their replies. If this is not known (at the start, or after a missing or malformed reply), it is
    established first, with lines that only read.

    Assume that at most n replies to a verb X (H or L) are still under way. Of the next n + 1 replies to X, at least one
    belongs to a line sent since. Then every line before that one is settled: it has its reply, or will never have one.
    So when the other verb Y is sent after that, the first reply to Y belongs to it. As Y was the last line, nothing is
    under way.

    This needs no assumption about delays. Replies may be lost, cut, garbled, or late by any time. (A table that replies
    twice to a line violates the premise. The second reply is dropped if it is received before the next line is sent.)

    Attributes:
        clock: the clock of the port.
        decimals: decimal places of the numbers sent.
        reference: the prediction of the table's reference from the commands that were sent. A command without a reply
            counts as executed.
        greatest: the maximum S and the maximum A that the table has accepted.
    """

    def __init__(self, port: Port, timeout_s: float, decimals: int) -> None:
        """Use an open port and set its read timeout. Nothing is sent yet."""
        self.clock = clock_of(port)
        self._port = port
        self._port.timeout = timeout_s
        self._timeout_s = timeout_s
        self.decimals = decimals
        self.reference = PredictedReference()
        self.greatest: dict[Verb, float] = {}
        self._byte_s: float | None = None
        self._line_free_s = 0.0
        self._may_hold_half_line = True  # traffic of an earlier client
        # All pyserial ports have this method. In simulated time it needs one look at the table where single bytes need
        # many.
        self._read_until: Callable[[bytes, int], bytes] | None = getattr(port, "read_until", None)
        self._lines = LineBuffer()
        self._arrived: deque[bytes | ErrorCode] = deque()
        self._last_line = "nothing"
        self._reply_bytes = 0
        # An upper bound of the replies still under way. An earlier client that waited for each reply, as the protocol
        # requires, left at most one.
        self._unanswered = Counter({Verb.READ_POSITION: 1, Verb.READ_LATCH: 1})

    def exchange(self, command: Command) -> Angle | Ok:
        """Send a command and return its reply, which has the kind that the verb defines.

        Raises:
            CommandRefused: the table refused the command, and changed nothing.
            ReplyTimeout: no reply in time. The message states whether the command had been sent.
            UnexpectedReply: the received line is not a reply to the command, which may have been executed.
            PortError: the port failed.
            ProtocolMisuse: the protocol cannot express this command; nothing was sent.
        """
        sent = encode_command(command, self.decimals)
        if self.has_lost_its_place:
            self._find_place()
        before, sent_s = self.reference, self.clock.now_s()
        self._send(command.verb, sent)
        deadline_s = self.clock.now_s() + self._timeout_s
        reply = self._next_reply(sent, deadline_s, "it may have been executed")
        if not _answers(reply, command.verb):
            raise UnexpectedReply(
                f"sent {sent!r}, got {self._last_line}, which is the reply to another command;"
                " check that no other program uses the port, then try again"
            )
        self._unanswered[command.verb] -= 1
        if isinstance(reply, Refusal):
            self.reference = before
            code = reply.code
            raise CommandRefused(f"sent {sent!r}, got ERR {code} {code.text}: {_WHAT_TO_DO[code]}", code)
        self._learn(command, sent, reply, sent_s)
        return reply

    def send_at_once(self, commands: Sequence[Command]) -> None:
        """Send commands in one write, even when replies are missing. Their own replies are not waited for."""
        lines, arrival_s = self._lines_of(commands), self.arrival_s(commands)
        self._unanswered.update(command.verb for command in commands)
        self._write(b"".join((self._cancel, *lines)))
        for line in lines:
            self._take_for_carried_out(line, arrival_s)

    def arrival_s(self, commands: Sequence[Command]) -> float:
        """Return when commands that are sent at once have reached the table."""
        return self._passed_s(b"".join((self._cancel, *self._lines_of(commands))))

    def rests_at(self, angle_deg: float) -> None:
        """Record that the table was observed at rest."""
        self.reference = self.reference.resting(angle_deg, self.clock.now_s())

    @property
    def has_lost_its_place(self) -> bool:
        """Whether the next reply may belong to another command than the next one."""
        return self._unanswered.total() > 0

    @property
    def _cancel(self) -> bytes:
        """The bytes that end an incomplete line at the table."""
        return _CANCEL if self._may_hold_half_line else b""

    def _lines_of(self, commands: Sequence[Command]) -> list[bytes]:
        return [encode_command(command, self.decimals) for command in commands]

    def _passed_s(self, data: bytes) -> float:
        """Return when bytes that are sent now have been transmitted."""
        return max(self._line_free_s, self.clock.now_s()) + len(data) * self._seconds_a_byte

    def _find_place(self) -> None:
        """Make sure that no reply is under way, as the docstring of the class proves, or raise ReplyTimeout.

        The first read checks that the table is alive. While the table is silent, only `other` collects reads without
        replies. So resynchronization needs few of them however long the silence was.
        """
        self._write(_CANCEL)
        known, other = sorted((Verb.READ_POSITION, Verb.READ_LATCH), key=lambda verb: self._unanswered[verb])
        self._ask(other)
        for _ in range(self._unanswered[known] + 1):
            self._ask(known)
        self._ask(other)
        self._unanswered.clear()

    def _ask(self, verb: Verb) -> None:
        """Send a read and wait for a reply to this verb, from this line or an earlier one.

        Everything else is dropped.
        """
        sent = encode_command(Command(verb))
        self._send(verb, sent)
        deadline_s = self.clock.now_s() + self._timeout_s
        while True:
            try:
                reply = self._next_reply(sent, deadline_s, "no other command was sent")
            except UnexpectedReply:
                continue
            if isinstance(reply, Angle) and reply.verb is verb:
                self._unanswered[verb] -= 1
                return

    def _send(self, verb: Verb, line: bytes) -> None:
        """Send a command. Bytes received before it are not its reply, and are dropped."""
        if waiting := self._waiting():
            self._receive(waiting)
        self._arrived.clear()
        self._lines.discard()
        self._last_line = "nothing"
        self._unanswered[verb] += 1
        arrival_s = self._passed_s(line)
        self.reference = self.reference.without_setting(verb)  # if an interrupt occurs while the line is written
        self._write(line)
        self._take_for_carried_out(line, arrival_s)

    def _take_for_carried_out(self, line: bytes, time_s: float) -> None:
        self.reference = self.reference.after(_command_in(line), time_s)

    def _learn(self, command: Command, sent: bytes, reply: Angle | Ok, sent_s: float) -> None:
        """Update the state from a reply: the table's position, its limits, the delay of the line."""
        now_s = self.clock.now_s()
        if isinstance(reply, Angle):
            if reply.verb is Verb.READ_POSITION:
                self.reference = self.reference.seen(float(reply.angle_deg), sent_s, now_s)
        elif command.verb in {Verb.SET_SPEED, Verb.SET_ACCELERATION}:
            value = float(_command_in(sent).value or 0)
            self.greatest[command.verb] = max(value, self.greatest.get(command.verb, 0.0))
        byte_s = (now_s - sent_s) / (len(sent) + self._reply_bytes)
        self._byte_s = byte_s if self._byte_s is None else min(byte_s, self._byte_s)

    @property
    def _seconds_a_byte(self) -> float:
        """Transmission time of a byte: from the fastest exchange so far, else from the port's baud rate."""
        if self._byte_s is not None:
            return self._byte_s
        baud = getattr(self._port, "baudrate", 0)
        return _BITS_A_BYTE / baud if baud else 0.0

    def _next_reply(self, sent: bytes, deadline_s: float, otherwise: str) -> Reply:
        """Return the next reply. Raise UnexpectedReply, or ReplyTimeout with the sentence `otherwise`."""
        while not self._arrived:
            # On a busy machine this program may see a reply late. It counts if it is available now.
            data = self._receive_line() if self.clock.now_s() < deadline_s or self._waiting() else b""
            if not data:
                raise ReplyTimeout(
                    f"sent {sent!r}, got {self._last_line}, and no reply to it within {self._timeout_s:g} s;"
                    f" check power, cable and baud rate, or increase the timeout; {otherwise}"
                )
            self._arrived.extend(self._lines.feed(data))
        line = self._arrived.popleft()
        _log.debug("received %r", line)
        self._reply_bytes = 1 + (len(line) if isinstance(line, bytes) else 0)
        self._last_line = f"a faulty line ({line.text})" if isinstance(line, ErrorCode) else repr(line)
        if isinstance(line, bytes):
            with suppress(UnexpectedReply):
                return decode_reply(line)
        raise UnexpectedReply(
            f"sent {sent!r}, got {self._last_line}, which is not a reply of the protocol; check baud rate and cable"
        )

    def _waiting(self) -> int:
        try:
            return self._port.in_waiting
        except OSError as error:
            raise self._died(error) from error

    def _receive_line(self) -> bytes:
        """Return the received bytes up to a CR, or fewer; none after the port's timeout."""
        if self._read_until is None:
            return self._receive(max(1, self._waiting()))
        try:
            return bytes(self._read_until(_CR, _LONGEST_READ))
        except OSError as error:
            raise self._died(error) from error

    def _receive(self, size: int) -> bytes:
        """Return the given number of bytes, or fewer after the port's timeout."""
        try:
            return self._port.read(size)
        except OSError as error:
            raise self._died(error) from error

    def _write(self, data: bytes) -> None:
        self._line_free_s = self._passed_s(data)
        is_fresh, self._may_hold_half_line = self._may_hold_half_line, True  # if an interrupt occurs during the write
        _log.debug("sent %r", data)
        try:
            self._port.write(data)
        except OSError as error:
            raise self._died(error) from error
        self._may_hold_half_line = is_fresh and not data.startswith(_CANCEL)

    @staticmethod
    def _died(error: OSError) -> PortError:
        return PortError(f"the port failed: {error}; check the table, then open it again")


def _command_in(line: bytes) -> Command:
    """Return the command in a line of this client, with its rounded number."""
    command = decode_command(line.removesuffix(b"\r"))
    assert isinstance(command, Command)
    return command


def _answers(reply: Reply, verb: Verb) -> bool:
    if isinstance(reply, Angle):
        return reply.verb is verb
    return isinstance(reply, Refusal | VERBS[verb].reply)
