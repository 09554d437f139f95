"""The client against a table in virtual time, whose replies meet the fates that a test gives them.

The table answers H and L with the number of lines that it has heard, so a reply tells which line it answers.
"""

from collections import deque
from collections.abc import Callable, Iterable
from contextlib import suppress
from decimal import Decimal

import pytest
from hypothesis import given
from hypothesis import strategies as st

from protocol import (
    VERBS,
    Angle,
    ArrivalTimeout,
    Command,
    CommandRefused,
    ErrorCode,
    LineBuffer,
    Ok,
    PortError,
    ProtocolMisuse,
    Refusal,
    Reply,
    ReplyTimeout,
    TableClient,
    TableError,
    UnexpectedReply,
    Verb,
    decode_command,
    encode_reply,
)

Fate = Callable[[bytes], list[tuple[float, bytes]]]
"""What becomes of a reply: the pieces that arrive, each with its delay in seconds beyond the table's own."""

BYTE_S = 10 / 9600
PROMPT_S = 0.001


def prompt(reply: bytes) -> list[tuple[float, bytes]]:
    return [(0.0, reply)]


def lost(_reply: bytes) -> list[tuple[float, bytes]]:
    return []


def doubled(reply: bytes) -> list[tuple[float, bytes]]:
    return [(0.0, reply + reply)]


def garbled(reply: bytes) -> list[tuple[float, bytes]]:
    return [(0.0, b"\xff" + reply[1:])]


def late(delay_s: float) -> Fate:
    return lambda reply: [(delay_s, reply)]


def cut(length: int, delay_s: float = 0.0) -> Fate:
    return lambda reply: [(delay_s, reply[:length])]


def torn(length: int, delay_s: float) -> Fate:
    return lambda reply: [(0.0, reply[:length]), (delay_s, reply[length:])]


def replaced(other: bytes) -> Fate:
    return lambda _reply: [(0.0, other)]


class VirtualClock:
    def __init__(self) -> None:
        self.time_s = 0.0

    def now_s(self) -> float:
        return self.time_s

    def sleep_s(self, duration_s: float) -> None:
        self.time_s += duration_s


class TablePort:
    """A port in virtual time with a table behind it; `fates` are those of its first replies, later ones are prompt."""

    def __init__(self, fates: Iterable[Fate] = (), *, latency_s: float = PROMPT_S, strict: bool = False) -> None:
        self.clock = VirtualClock()
        self.timeout: float | None = None
        self.is_open = True
        self.heard: list[Command | ErrorCode] = []
        self._fates = iter(fates)
        self._latency_s = latency_s
        self._strict = strict
        self._lines = LineBuffer()
        self._under_way: deque[tuple[float, int]] = deque()
        self._line_free_s = 0.0

    @property
    def in_waiting(self) -> int:
        return sum(arrival_s <= self.clock.time_s for arrival_s, _ in self._under_way)

    def read(self, size: int, /) -> bytes:
        assert self.timeout is not None, "a read without a time-out may never return"
        deadline_s = self.clock.time_s + self.timeout
        data = bytearray()
        while len(data) < size:
            if not self._under_way or self._under_way[0][0] > deadline_s:
                self.clock.time_s = deadline_s
                break
            arrival_s, byte = self._under_way.popleft()
            self.clock.time_s = max(self.clock.time_s, arrival_s)
            data.append(byte)
        return bytes(data)

    def write(self, data: bytes, /) -> int:
        for line in self._lines.feed(data):
            self._answer(decode_command(line) if isinstance(line, bytes) else line)
        return len(data)

    def close(self) -> None:
        self.is_open = False

    def _answer(self, heard: Command | ErrorCode) -> None:
        self.heard.append(heard)
        if isinstance(heard, ErrorCode) and self._strict:
            return
        for delay_s, piece in next(self._fates, prompt)(encode_reply(self._reply(heard))):
            arrival_s = self.clock.time_s + self._latency_s + delay_s
            for byte in piece:
                self._line_free_s = max(arrival_s, self._line_free_s) + BYTE_S
                self._under_way.append((self._line_free_s, byte))

    def _reply(self, heard: Command | ErrorCode) -> Reply:
        if isinstance(heard, ErrorCode):
            return Refusal(heard)
        if VERBS[heard.verb].reply is Angle:
            return Angle(heard.verb, Decimal(len(self.heard)))
        if heard.value is not None and abs(heard.value) > 1000:
            return Refusal(ErrorCode.OUT_OF_RANGE)
        return Ok()

    def give_fates(self, *fates: Fate) -> None:
        """Let the next replies meet these fates, and the table be prompt from now on."""
        self._fates = iter(fates)
        self._latency_s = PROMPT_S


class MovingTablePort(TablePort):
    """A table that turns at a constant speed to its target, and stands there."""

    def __init__(self, speed_deg_s: float, target_deg: float) -> None:
        super().__init__()
        self._speed_deg_s = speed_deg_s
        self._target_deg = target_deg

    def _reply(self, heard: Command | ErrorCode) -> Reply:
        reply = super()._reply(heard)
        if not isinstance(reply, Angle):
            return reply
        return Angle(reply.verb, Decimal(min(self._target_deg, self._speed_deg_s * self.clock.time_s)))


class DeadPort(TablePort):
    def write(self, data: bytes, /) -> int:
        raise OSError(5, f"{len(data)} bytes could not be sent")


def client_in_place(port: TablePort) -> TableClient:
    """Return a client that has had its first answer."""
    client = TableClient(port)
    client.position_deg()
    return client


def last_said(port: TablePort) -> tuple[str, Decimal | None]:
    command = port.heard[-1]
    assert isinstance(command, Command)
    return command.verb, command.value


def test_each_verb_has_its_method() -> None:
    port = TablePort()
    client = client_in_place(port)
    assert client.position_deg() == len(port.heard)
    assert last_said(port) == ("H", None)
    assert client.latched_deg() == len(port.heard)
    assert last_said(port) == ("L", None)
    client.move_to(-12.34)
    assert last_said(port) == ("P", Decimal("-12.3"))
    client.move_by(Decimal(10))
    assert last_said(port) == ("R", Decimal("10.0"))
    client.set_speed(20)
    assert last_said(port) == ("S", Decimal("20.0"))
    client.set_acceleration(5.5)
    assert last_said(port) == ("A", Decimal("5.5"))


def test_more_decimals_are_sent_when_asked_for() -> None:
    port = TablePort()
    TableClient(port, decimals=3).move_to(0.0625)
    assert last_said(port) == ("P", Decimal("0.062"))


def test_in_place_each_command_is_one_line() -> None:
    port = TablePort()
    client = client_in_place(port)
    before = len(port.heard)
    for _ in range(10):
        client.move_by(1)
    assert len(port.heard) == before + 10


def test_leaving_the_block_closes_the_port() -> None:
    port = TablePort()
    with TableClient(port) as client:
        client.position_deg()
    assert not port.is_open


def test_a_refusal_tells_what_was_sent_what_came_back_and_what_to_do() -> None:
    client = client_in_place(TablePort())
    with pytest.raises(
        CommandRefused, match=r"sent b'P 2000.0\\r', got ERR 3 out of range: ask for .* limits"
    ) as refusal:
        client.move_to(2000)
    assert refusal.value.code is ErrorCode.OUT_OF_RANGE
    assert client.position_deg() > 0


@pytest.mark.parametrize("value", [float("nan"), float("inf"), 1e40])
def test_misuse_sends_nothing(value: float) -> None:
    port = TablePort()
    with pytest.raises(ProtocolMisuse):
        TableClient(port).move_to(value)
    assert port.heard == []


def test_a_silent_table_is_told_from_one_that_says_something_else() -> None:
    client = client_in_place(port := TablePort())
    port.give_fates(lost)
    with pytest.raises(ReplyTimeout, match=r"sent b'H\\r', got nothing, .* within 1 s; check power"):
        client.position_deg()
    with pytest.raises(ReplyTimeout, match="got b'login:'"):
        TableClient(TablePort([replaced(b"login:\r")] * 9)).position_deg()


def test_a_time_out_tells_whether_the_command_was_sent() -> None:
    client = client_in_place(port := TablePort())
    port.give_fates(*[lost] * 10)
    with pytest.raises(ReplyTimeout, match=r"sent b'P 1.0\\r', .* it may have been carried out"):
        client.move_to(1)
    with pytest.raises(ReplyTimeout, match="nothing else was sent"):
        client.move_to(2)
    assert Command(Verb.MOVE_TO, Decimal(2)) not in port.heard


def test_a_time_out_takes_the_time_that_it_says() -> None:
    client = client_in_place(port := TablePort())
    port.give_fates(lost)
    before_s = port.clock.now_s()
    with pytest.raises(ReplyTimeout):
        client.position_deg()
    assert port.clock.now_s() - before_s == pytest.approx(1.0)


def test_a_dead_port_is_a_port_error() -> None:
    with pytest.raises(PortError, match=r"could not be sent; check the table"):
        TableClient(DeadPort()).position_deg()


@pytest.mark.parametrize("fate", [lost, late(1.5), cut(3), torn(3, 1.5), garbled, replaced(b"OK\r"), replaced(b"hm\r")])
@pytest.mark.parametrize("strict", [False, True])
def test_after_a_spoilt_reply_the_next_answer_is_the_right_one(fate: Fate, strict: bool) -> None:
    client = client_in_place(port := TablePort(strict=strict))
    port.give_fates(fate)
    with pytest.raises((ReplyTimeout, UnexpectedReply)):
        client.position_deg()
    assert client.position_deg() == len(port.heard)
    port.clock.sleep_s(10)
    assert client.position_deg() == len(port.heard)


def test_a_late_refusal_does_not_refuse_the_next_command() -> None:
    client = client_in_place(port := TablePort())
    port.give_fates(late(1.001))
    with pytest.raises(ReplyTimeout):
        client.move_to(2000)
    client.move_to(20)
    assert last_said(port) == ("P", Decimal("20.0"))


def test_a_reply_that_came_twice_is_dropped_before_the_next_command() -> None:
    client = client_in_place(port := TablePort())
    port.give_fates(doubled)
    client.position_deg()
    port.clock.sleep_s(0.1)
    assert client.position_deg() == len(port.heard)


def test_finding_the_place_is_quick_however_long_the_table_was_away() -> None:
    client = client_in_place(port := TablePort())
    port.give_fates(*[lost] * 1000)
    for _ in range(300):
        with pytest.raises(ReplyTimeout):
            client.position_deg()
    port.give_fates()
    before = len(port.heard)
    assert client.position_deg() == len(port.heard)
    assert len(port.heard) - before < 10


def test_a_half_command_of_a_dead_client_is_never_carried_out() -> None:
    port = TablePort()
    port.write(b"P 12")
    assert TableClient(port).position_deg() == len(port.heard)
    assert ErrorCode.BAD_BYTE in port.heard
    assert not any(isinstance(heard, Command) and heard.verb == "P" for heard in port.heard)


@pytest.mark.parametrize("left_behind", [b"H\rP 1.0\rL\r", b"L\rP 1.0\rH\r"])
def test_the_replies_to_a_dead_client_are_not_those_to_the_next(left_behind: bytes) -> None:
    port = TablePort(latency_s=0.9)
    port.write(left_behind)
    port.clock.sleep_s(0.8)
    client = TableClient(port)
    for _ in range(4):
        assert client.position_deg() == len(port.heard)
        assert client.latched_deg() == len(port.heard)


def test_the_head_of_a_reply_that_came_too_late_does_not_spoil_the_next() -> None:
    client = client_in_place(port := TablePort(strict=True))
    port.give_fates(cut(3, delay_s=2))
    with pytest.raises(ReplyTimeout):
        client.position_deg()
    port.clock.sleep_s(5)
    assert client.position_deg() == len(port.heard)


def test_stop_is_sent_even_when_replies_are_missing() -> None:
    client = client_in_place(port := TablePort())
    port.give_fates(*[lost] * 10)
    with pytest.raises(ReplyTimeout):
        client.move_by(90)
    with pytest.raises(ReplyTimeout):
        client.stop()
    assert ("R", Decimal("0.0")) in [(heard.verb, heard.value) for heard in port.heard if isinstance(heard, Command)]


def test_stop_in_place_is_one_line() -> None:
    client = client_in_place(port := TablePort())
    before = len(port.heard)
    client.stop()
    assert last_said(port) == ("R", Decimal("0.0"))
    assert len(port.heard) == before + 1


def test_arrival_is_two_readings_in_a_row_at_the_target() -> None:
    port = MovingTablePort(speed_deg_s=10, target_deg=30)
    seen: list[float] = []
    assert TableClient(port).wait_until_at(30, timeout_s=10, progress=seen.append) == 30
    assert seen == sorted(seen)
    assert seen[-2:] == [30, 30]
    assert port.clock.now_s() == pytest.approx(3.0, abs=0.3)


def test_a_table_that_passes_by_has_not_arrived() -> None:
    client = TableClient(MovingTablePort(speed_deg_s=10, target_deg=90))
    with pytest.raises(ArrivalTimeout, match=r"stands at 90\.0 deg") as arrival:
        client.wait_until_at(30, tolerance_deg=0.25, timeout_s=20)
    assert arrival.value.position_deg == 90


def test_a_difference_of_just_the_tolerance_is_an_arrival() -> None:
    client = TableClient(MovingTablePort(speed_deg_s=100, target_deg=12.4))
    assert client.wait_until_at(12.35, tolerance_deg=0.05) == 12.4


fates = st.one_of(
    st.just(prompt),
    st.sampled_from([lost, garbled]),
    st.floats(0, 3).map(late),
    st.builds(cut, st.integers(0, 6), st.floats(0, 3)),
    st.builds(torn, st.integers(1, 6), st.floats(0, 3)),
)


@given(
    fates=st.lists(fates, max_size=20),
    latency_s=st.floats(0, 1.5),
    strict=st.booleans(),
    left_behind=st.permutations([b"H\r", b"L\r", b"P 1.0\r", b"X\r"]),
    half_line=st.sampled_from([b"", b"H", b"P 1", b"\xff"]),
    pause_s=st.floats(0, 1.5),
    said=st.lists(st.sampled_from(["H", "L", "P", "bad P"]), max_size=8),
)
def test_no_answer_is_ever_that_to_another_command(
    *,
    fates: list[Fate],
    latency_s: float,
    strict: bool,
    left_behind: list[bytes],
    half_line: bytes,
    pause_s: float,
    said: list[str],
) -> None:
    port = TablePort(fates, latency_s=latency_s, strict=strict)
    port.write(b"".join(left_behind) + half_line)
    port.clock.sleep_s(pause_s)
    client = TableClient(port)
    for what in said:
        with suppress(ReplyTimeout, UnexpectedReply):
            say_and_check(client, port, what)
    port.give_fates()
    port.clock.sleep_s(100)
    say_and_check(client, port, "H")


def say_and_check(client: TableClient, port: TablePort, what: str) -> None:
    """Let the client say something; the answer must be that to the line which the table has heard last."""
    match what:
        case "H":
            assert client.position_deg() == len(port.heard)
        case "L":
            assert client.latched_deg() == len(port.heard)
        case "P":
            client.move_to(1)
        case _:
            with pytest.raises(TableError) as refusal:
                client.move_to(2000)
            if not isinstance(refusal.value, CommandRefused):
                raise refusal.value


class StarvedClock(VirtualClock):
    """The clock of a program that gets the processor back two seconds after each look at it."""

    def now_s(self) -> float:
        self.time_s += 2.0
        return self.time_s


def test_a_reply_that_is_there_counts_however_late_the_client_looks() -> None:
    port = TablePort()
    port.clock = StarvedClock()
    assert TableClient(port, timeout_s=1.0).position_deg() > 0.0
