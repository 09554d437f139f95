"""Question and answer over a port, and finding the place again when an answer is missing."""

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

# A half command that is left at the table must not be carried out when the next CR comes. CAN (0x18) is no printable
# byte, so it spoils whatever stands there.
_CANCEL = b"\x18\r"
_CR = b"\r"
_LONGEST_READ = 2 * LINE_LIMIT

_BITS_A_BYTE = 10

_WHAT_TO_DO = {
    ErrorCode.UNKNOWN_COMMAND: "is this a table of this protocol, or is the line noisy?",
    ErrorCode.BAD_NUMBER: "the line is noisy, or the table reads numbers otherwise",
    ErrorCode.OUT_OF_RANGE: "ask for a value within the table's limits",
    ErrorCode.LINE_TOO_LONG: "a CR was lost: check the line, then send it again",
    ErrorCode.BAD_BYTE: "check baud rate and cable, then send it again",
}


class Dialogue:
    """Sends a command and returns the reply to it, never that to another.

    Replies carry no number; all that is known is that they come in order, at most one for each line. So a command is
    sent only when all earlier ones are answered, and when that is not known (at the start, after a reply was missing
    or malformed) it is first brought about, with lines that only read. Let at most n replies to a verb X (H or L)
    still be under way. Of the next n + 1 replies to X at least one then answers a line sent since, and all that was
    sent before that line is settled: answered, or never to be. So when the other verb Y is sent after that, the first
    reply to Y answers it, and as Y was the last line, nothing is under way. No assumption about delays is made;
    replies may be lost, cut, garbled, or late by any time. (A table that answers a line twice breaks the premise; the
    second answer is dropped if it is there before the next line is sent.)

    Attributes:
        clock: that of the port.
        decimals: decimal places of the numbers sent.
        reference: where the commands that were sent have brought the table's reference. A command whose reply is
            missing counts as carried out.
        greatest: the greatest S and the greatest A that the table has accepted.
    """

    def __init__(self, port: Port, timeout_s: float, decimals: int) -> None:
        """Take over an open port, set its read time-out, and send nothing yet."""
        self.clock = clock_of(port)
        self._port = port
        self._port.timeout = timeout_s
        self._timeout_s = timeout_s
        self.decimals = decimals
        self.reference = PredictedReference()
        self.greatest: dict[Verb, float] = {}
        self._byte_s: float | None = None
        self._line_free_s = 0.0
        self._may_hold_half_line = True  # that of whoever used the line before
        # What all of pyserial's ports have. In virtual time it takes one look at the table where bytes take many.
        self._read_until: Callable[[bytes, int], bytes] | None = getattr(port, "read_until", None)
        self._lines = LineBuffer()
        self._arrived: deque[bytes | ErrorCode] = deque()
        self._last_line = "nothing"
        self._reply_bytes = 0
        # An upper bound of the replies still under way. Whoever used the line before, waiting for each reply as the
        # protocol asks, left one at most.
        self._unanswered = Counter({Verb.READ_POSITION: 1, Verb.READ_LATCH: 1})

    def exchange(self, command: Command) -> Angle | Ok:
        """Send a command and return its reply, which is of the kind that the verb's acceptance has.

        Raises:
            CommandRefused: the table refused it, and changed nothing.
            ReplyTimeout: no reply in time; the message says whether the command had been sent.
            UnexpectedReply: what came is no answer to it; it may have been carried out.
            PortError: the port has died.
            ProtocolMisuse: the protocol cannot say this command; nothing was sent.
        """
        sent = encode_command(command, self.decimals)
        if self.has_lost_its_place:
            self._find_place()
        before, sent_s = self.reference, self.clock.now_s()
        self._send(command.verb, sent)
        deadline_s = self.clock.now_s() + self._timeout_s
        reply = self._next_reply(sent, deadline_s, "it may have been carried out")
        if not _answers(reply, command.verb):
            raise UnexpectedReply(
                f"sent {sent!r}, got {self._last_line}, which answers another command;"
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
        """Send commands in one write, even when replies are missing; their own are not waited for."""
        lines, arrival_s = self._lines_of(commands), self.arrival_s(commands)
        self._unanswered.update(command.verb for command in commands)
        self._write(b"".join((self._cancel, *lines)))
        for line in lines:
            self._take_for_carried_out(line, arrival_s)

    def arrival_s(self, commands: Sequence[Command]) -> float:
        """Return when commands that are sent at once have arrived at the table."""
        return self._passed_s(b"".join((self._cancel, *self._lines_of(commands))))

    def rests_at(self, angle_deg: float) -> None:
        """Take note that the table was seen to rest."""
        self.reference = self.reference.resting(angle_deg, self.clock.now_s())

    @property
    def has_lost_its_place(self) -> bool:
        """Whether the next reply could be any other than that to the next command."""
        return self._unanswered.total() > 0

    @property
    def _cancel(self) -> bytes:
        """What ends the half line that the table may hold."""
        return _CANCEL if self._may_hold_half_line else b""

    def _lines_of(self, commands: Sequence[Command]) -> list[bytes]:
        return [encode_command(command, self.decimals) for command in commands]

    def _passed_s(self, data: bytes) -> float:
        """Return when bytes that are sent now have passed the line."""
        return max(self._line_free_s, self.clock.now_s()) + len(data) * self._seconds_a_byte

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
                reply = self._next_reply(sent, deadline_s, "nothing else was sent")
            except UnexpectedReply:
                continue
            if isinstance(reply, Angle) and reply.verb is verb:
                self._unanswered[verb] -= 1
                return

    def _send(self, verb: Verb, line: bytes) -> None:
        """Send a command; what has come in before is no answer to it, and is dropped."""
        if waiting := self._waiting():
            self._receive(waiting)
        self._arrived.clear()
        self._lines.discard()
        self._last_line = "nothing"
        self._unanswered[verb] += 1
        arrival_s = self._passed_s(line)
        self.reference = self.reference.without_setting(verb)  # when an interrupt comes as the line is written
        self._write(line)
        self._take_for_carried_out(line, arrival_s)

    def _take_for_carried_out(self, line: bytes, time_s: float) -> None:
        self.reference = self.reference.after(_command_in(line), time_s)

    def _learn(self, command: Command, sent: bytes, reply: Angle | Ok, sent_s: float) -> None:
        """Take in what a reply tells: the table's position, its limits, the pace of the line."""
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
        """How long a byte is on its way: of the quickest exchange so far, else what the port's rate says."""
        if self._byte_s is not None:
            return self._byte_s
        baud = getattr(self._port, "baudrate", 0)
        return _BITS_A_BYTE / baud if baud else 0.0

    def _next_reply(self, sent: bytes, deadline_s: float, otherwise: str) -> Reply:
        """Return the next reply, or raise UnexpectedReply, or ReplyTimeout, which says what is `otherwise` so."""
        while not self._arrived:
            # A busy machine may have kept us from a reply that was in time: it counts if it is here by now.
            data = self._receive_line() if self.clock.now_s() < deadline_s or self._waiting() else b""
            if not data:
                raise ReplyTimeout(
                    f"sent {sent!r}, got {self._last_line}, and no reply to it within {self._timeout_s:g} s;"
                    f" check power, cable and baud rate, or allow more time; {otherwise}"
                )
            self._arrived.extend(self._lines.feed(data))
        line = self._arrived.popleft()
        self._reply_bytes = 1 + (len(line) if isinstance(line, bytes) else 0)
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

    def _receive_line(self) -> bytes:
        """Return what comes in up to a CR, or less; nothing when the port's time-out has passed."""
        if self._read_until is None:
            return self._receive(max(1, self._waiting()))
        try:
            return bytes(self._read_until(_CR, _LONGEST_READ))
        except OSError as error:
            raise self._died(error) from error

    def _receive(self, size: int) -> bytes:
        """Return so many bytes, or fewer when the port's time-out has passed."""
        try:
            return self._port.read(size)
        except OSError as error:
            raise self._died(error) from error

    def _write(self, data: bytes) -> None:
        self._line_free_s = self._passed_s(data)
        is_fresh, self._may_hold_half_line = self._may_hold_half_line, True  # when an interrupt comes amid the write
        try:
            self._port.write(data)
        except OSError as error:
            raise self._died(error) from error
        self._may_hold_half_line = is_fresh and not data.startswith(_CANCEL)

    @staticmethod
    def _died(error: OSError) -> PortError:
        return PortError(f"the port no longer works: {error}; check the table, then open it again")


def _command_in(line: bytes) -> Command:
    """Return the command that a line of our own says, with its number as it was rounded."""
    command = decode_command(line.removesuffix(b"\r"))
    assert isinstance(command, Command)
    return command


def _answers(reply: Reply, verb: Verb) -> bool:
    if isinstance(reply, Angle):
        return reply.verb is verb
    return isinstance(reply, Refusal | VERBS[verb].reply)
