import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
import serial
from hypothesis import given, settings
from hypothesis import strategies as st

import emulator
from emulator.faults.fault import fault_from
from emulator.protocol_emulator import OUTPUT_BYTES, Serial
from protocol import TableClient, WallClock
from protocol.clock import clock_of


def open_port(query: str = "", **settings: Any) -> Serial:  # noqa: ANN401  # whatever pyserial takes
    port = serial.serial_for_url("emulator://" + query, **{"timeout": 1.0, **settings})
    assert isinstance(port, Serial)
    return port


@pytest.fixture
def port() -> Iterator[Serial]:
    with open_port() as port:
        yield port


def ask(port: Serial, command: bytes) -> bytes:
    port.write(command + b"\r")
    return port.read_until(b"\r")


def test_importing_the_package_teaches_pyserial_the_url() -> None:
    assert emulator.__name__ in serial.protocol_handler_packages


def test_a_client_drives_the_table_in_simulated_time() -> None:
    with TableClient.open("emulator://") as client:
        client.set_speed(10)
        client.set_acceleration(20)
        begin_s = client.clock.now_s()
        client.move_to(90)
        assert client.wait_until_at(90) == 90.0
        # A trapezoid of 90 deg at 10 deg/s and 20 deg/s2 takes 90 / 10 + 10 / 20 s.
        assert 9.5 <= client.clock.now_s() - begin_s < 10.5


def test_simulated_time_is_not_wall_time(port: Serial) -> None:
    begin_s = time.monotonic()
    port.clock.sleep_s(100_000.0)
    assert port.clock.now_s() == 100_000.0
    assert time.monotonic() - begin_s < 1000.0


def test_the_port_carries_the_clock_that_a_client_reads(port: Serial) -> None:
    assert clock_of(port) is port.clock
    assert not isinstance(clock_of(port), WallClock)


def test_the_same_session_gives_the_same_bytes_at_the_same_time() -> None:
    def session() -> list[object]:
        with open_port("?seed=7") as port:
            replies: list[object] = [ask(port, command) for command in (b"S 30", b"P 20", b"H", b"P -5.5", b"H", b"Z")]
            port.clock.sleep_s(0.5)
            return [*replies, ask(port, b"H"), port.clock.now_s(), port.table.status()]

    assert session() == session()


def test_read_returns_what_came_when_the_time_is_over(port: Serial) -> None:
    port.timeout = 0.25
    begin_s = port.clock.now_s()
    port.write(b"H\r")
    assert port.read(100) == b"H 0.0\r"
    assert port.clock.now_s() - begin_s == 0.25


def test_read_returns_as_soon_as_it_has_what_was_asked_for(port: Serial) -> None:
    port.write(b"H\r")
    assert port.read(6) == b"H 0.0\r"
    # Eight bytes of ten bits at 9600 baud, in ticks of a millisecond, and one tick for the firmware to reply.
    assert 8 * 10 / 9600 <= port.clock.now_s() <= 8 * 10 / 9600 + 0.003


def test_read_without_waiting_returns_what_is_there_and_comes_to_an_end(port: Serial) -> None:
    port.timeout = 0
    assert port.read(10) == b""
    port.write(b"H\r")
    received = b""
    while not received.endswith(b"\r"):
        received += port.read(10)
    assert received == b"H 0.0\r"


def test_a_loop_over_in_waiting_comes_to_an_end(port: Serial) -> None:
    port.write(b"H\r")
    while port.in_waiting < 6:
        port.advance(1)
    assert port.in_waiting == 6
    assert port.read_all() == b"H 0.0\r"
    before = port.table.tick
    assert port.in_waiting == 0
    assert port.table.tick == before + 1


def test_a_read_that_would_never_return_says_so(port: Serial) -> None:
    port.timeout = None
    assert ask(port, b"H") == b"H 0.0\r"
    with pytest.raises(serial.SerialException, match="would not end"):
        port.read(1)


def test_read_until_keeps_to_the_whole_time_out(port: Serial) -> None:
    port.timeout = 0.02
    port.write(b"Q\r" * 5)
    begin_s = port.clock.now_s()
    assert port.read_until(b"never") != b""
    assert port.clock.now_s() - begin_s == pytest.approx(0.02)


def test_readline_and_size_limits_work_as_pyserials(port: Serial) -> None:
    port.write(b"H\rL\r")
    assert port.read_until(b"\r", size=3) == b"H 0"
    assert port.read_until(b"\r") == b".0\r"
    assert port.readline() == b"L 0.0\r"


def test_write_waits_for_a_slow_line_and_gives_up_in_time() -> None:
    with open_port(write_timeout=0.1) as port:
        assert port.write(b"H" * OUTPUT_BYTES) == OUTPUT_BYTES
        assert port.out_waiting == OUTPUT_BYTES
        begin_s = port.clock.now_s()
        with pytest.raises(serial.SerialTimeoutException):
            port.write(b"H" * OUTPUT_BYTES)
        assert port.clock.now_s() - begin_s == pytest.approx(0.1)


def test_flush_waits_until_the_table_has_it_all(port: Serial) -> None:
    port.write(b"P 1\r")
    port.flush()
    assert port.out_waiting == 0
    assert port.table.status().state == "moving"


def test_what_came_can_be_thrown_away(port: Serial) -> None:
    port.write(b"H\r")
    port.clock.sleep_s(0.1)
    port.reset_input_buffer()
    assert ask(port, b"L") == b"L 0.0\r"


def test_closing_leaves_the_motion_running_and_a_half_line_behind(port: Serial) -> None:
    ask(port, b"P 5")
    port.write(b"P 9")
    port.close()
    with pytest.raises(serial.SerialException):
        port.write(b"H\r")
    port.open()
    assert ask(port, b"H").startswith(b"H ")
    port.clock.sleep_s(5.0)
    assert ask(port, b"H") == b"H 5.0\r"


def test_a_port_that_goes_away_while_it_is_closed_is_closed(port: Serial) -> None:
    port.write(b"H\r" * 300)
    port.table.inject(fault_from("hang-up", {"at_s": port.clock.now_s() + 0.05}))
    port.close()
    assert not port.is_open


def test_options_of_the_url_reach_the_table(tmp_path: Path) -> None:
    path = tmp_path / "slow.toml"
    path.write_text("[power_on]\nspeed_deg_s = 1.0\n")
    with open_port(f"?config={path}&decimals=3&baud=0&strict=1&trigger_hz=100") as port:
        assert ask(port, b"P 2") == b"OK\r"
        port.clock.sleep_s(1.0)
        assert 0.5 < float(ask(port, b"H")[2:]) < 1.0
        assert float(ask(port, b"L")[2:]) > 0.5
        port.clock.sleep_s(5.0)
        assert float(ask(port, b"H")[2:]) == pytest.approx(2.0, abs=0.05)
        assert ask(port, b"Q") == b""


@pytest.mark.parametrize(
    "url",
    [
        "emulator://table",
        "emulator:///path",
        "emulator://?speed=1",
        "emulator://?seed=x",
        "emulator://?baud=-1",
        "emulator://?decimals=99",
        "emulator://?strict=maybe",
        "emulator://?trigger_hz=fast",
        "emulator://?trigger_hz=-1",
        "emulator://?config=/no/such/file.toml",
    ],
)
def test_a_url_that_cannot_be_used_is_refused_in_one_sentence(url: str) -> None:
    with pytest.raises(serial.SerialException, match="emulator://") as refused:
        serial.serial_for_url(url)
    assert "\n" not in str(refused.value)


def test_a_wrong_rate_is_garbage_as_on_a_wire() -> None:
    with open_port(baudrate=19200) as port:
        assert ask(port, b"P 90") != b"OK\r"
        port.baudrate = 9600
        port.write(b"\r")
        port.clock.sleep_s(0.5)
        port.reset_input_buffer()
        assert ask(port, b"H") == b"H 0.0\r"


def test_without_pacing_any_rate_will_do_and_replies_are_there_at_once() -> None:
    with open_port("?baud=0", baudrate=300, timeout=0) as port:
        port.write(b"H\r")
        assert port.read(100) == b"H 0.0\r"
        assert port.clock.now_s() == 0.0


@pytest.mark.parametrize("setting", [{"bytesize": serial.SEVENBITS}, {"parity": serial.PARITY_EVEN}])
def test_anything_but_8n1_is_refused(setting: dict[str, Any]) -> None:
    with pytest.raises(serial.SerialException, match="8N1"):
        open_port(**setting)


def test_a_rate_of_nothing_is_refused() -> None:
    with pytest.raises(serial.SerialException, match="baud rate of 0"):
        open_port(baudrate=0)


@settings(max_examples=25, deadline=None)
@given(st.lists(st.binary(max_size=40), max_size=8))
def test_any_bytes_leave_a_table_that_answers(pieces: list[bytes]) -> None:
    with open_port("?baud=115200", baudrate=115200) as port:
        for piece in pieces:
            port.write(piece)
        port.write(b"\r")
        port.clock.sleep_s(0.5)
        port.reset_input_buffer()
        assert ask(port, b"H").startswith(b"H ")


class ByteByByte(Serial):
    """The port without leaps: it reads the table after each byte in either direction."""

    def _advance_to_bytes(self, wanted: int, deadline: int | None) -> bool:
        del wanted
        return self._advance_to_byte(deadline)


WRITTEN = [b"H\r", b"P 5\rH\r", b"R -3", b"\r", b"L\rL\rL\r", b"Q" * 40, b"S 1\r" * 30]
FAULTS: list[tuple[str, dict[str, float]]] = [
    ("drop", {"probability": 0.3}),
    ("half-reply", {"bytes": 2}),
    ("delay", {"seconds": 0.01, "for_s": 0.2}),
]
CALLS = st.one_of(
    st.tuples(st.just("write"), st.sampled_from(WRITTEN)),
    st.tuples(st.just("read"), st.integers(0, 30)),
    st.tuples(st.just("read_until"), st.sampled_from([b"\r", b"0\r", b"\n", b"K"])),
    st.tuples(st.just("in_waiting"), st.none()),
    st.tuples(st.just("flush"), st.none()),
    st.tuples(st.just("sleep"), st.integers(0, 50)),
    st.tuples(st.just("timeout"), st.sampled_from([0, 0.003, 0.05, 1.0])),
    st.tuples(st.just("baudrate"), st.sampled_from([9600, 4800, 115_200])),
    st.tuples(st.just("fault"), st.sampled_from(FAULTS)),
    st.tuples(st.just("train"), st.sampled_from([0.0, 170.0])),
)


def call(port: Serial, name: str, what: Any) -> object:  # noqa: ANN401  # whatever the call takes
    match name:
        case "write" | "read" | "read_until":
            return getattr(port, name)(what)
        case "in_waiting":
            return port.in_waiting
        case "flush":
            port.flush()
        case "sleep":
            port.clock.sleep_s(what / 1000)
        case "fault":
            port.table.inject(fault_from(*what))
        case "train":
            port.table.trigger_hz = what
        case _:
            setattr(port, name, what)
    return None


@pytest.mark.parametrize("query", ["", "?baud=300", "?baud=115200&decimals=4", "?baud=4000000", "?baud=0"])
def test_leaps_end_where_single_steps_do(query: str) -> None:
    leaping, stepping = (kind("emulator://" + query, timeout=0.5) for kind in (Serial, ByteByByte))
    for line in (b"H\r", b"P 5\r", b"H\rL\r", b"Q\r", b"R 3\rH\r"):
        for name, what in (("write", line), ("read", 2), ("read_until", b"\r"), ("sleep", 7), ("read_until", b"\r")):
            assert call(leaping, name, what) == call(stepping, name, what), (line, name)
            assert leaping.table.tick == stepping.table.tick, (line, name)


@settings(max_examples=60)
@given(
    calls=st.lists(CALLS, max_size=25),
    query=st.sampled_from(["", "?baud=300", "?baud=115200&decimals=4", "?baud=4000000", "?baud=0", "?strict=1"]),
)
def test_leaps_to_whole_lines_change_neither_bytes_nor_times(calls: list[tuple[str, Any]], query: str) -> None:
    leaping, stepping = (kind("emulator://" + query, timeout=0.2) for kind in (Serial, ByteByByte))
    for name, what in calls:
        assert call(leaping, name, what) == call(stepping, name, what), (name, what)
        assert leaping.table.tick == stepping.table.tick, (name, what)
    assert leaping.table.status() == stepping.table.status()


def test_only_a_url_in_the_wrong_form_is_answered_with_the_form(tmp_path: Path) -> None:
    path = tmp_path / "table.toml"
    path.write_text("[gears]\nratio = -1\n", encoding="utf-8")

    with pytest.raises(
        serial.SerialException, match=r"table\.toml: gears\.ratio is -1; it must be .* at least 1 and at most 100000$"
    ):
        serial.serial_for_url(f"emulator://?config={path}")
    with pytest.raises(serial.SerialException, match=r"the form is emulator://"):
        serial.serial_for_url("emulator://?seed=x")
