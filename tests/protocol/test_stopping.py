"""Stopping a table in virtual time: its travel, its duration, and forbidden effects."""

from dataclasses import dataclass
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import emulator  # noqa: F401 - teaches pyserial the port emulator://
from emulator.faults.fault import fault_from
from protocol import NotStopped, PortError, TableClient
from protocol.bench import SimulatedBench, bench_of

FASTEST, HARDEST = 40.0, 100.0


@dataclass
class Stopped:
    """The motion of the reference after the stop."""

    speed_deg_s: float
    rate_deg_s2: float
    way_deg: float
    back_deg: float
    rest_s: float
    position_deg: float
    end_deg: float

    @property
    def beyond_deg(self) -> float:
        """How much farther than from the present speed at the maximum A."""
        return self.way_deg - self.speed_deg_s**2 / (2 * self.rate_deg_s2)

    @property
    def beyond_s(self) -> float:
        return self.rest_s - abs(self.speed_deg_s) / self.rate_deg_s2


def stopped(client: TableClient, table: SimulatedBench, rate_deg_s2: float = HARDEST) -> Stopped:
    """Stop a table, and return the motion of its reference."""
    before = table.status()
    seen = [before]
    table.observer = lambda status, _heard, _said: seen.append(status)
    position_deg = client.stop()
    table.observer = None
    forward = -1.0 if before.reference_speed_deg_s < 0 else 1.0
    ways = [forward * (each.reference_deg - before.reference_deg) for each in seen]
    moving = [each.tick for each in seen if each.reference_speed_deg_s]
    rest_s = (max(moving, default=before.tick) - before.tick) / 1000
    speed_deg_s = abs(before.reference_speed_deg_s)
    end_deg = seen[-1].reference_deg
    return Stopped(speed_deg_s, rate_deg_s2, max(ways), max(ways) - ways[-1], rest_s, position_deg, end_deg)


def check(one: Stopped) -> None:
    assert one.beyond_deg <= 1.0
    assert one.beyond_s <= 0.5
    assert one.back_deg <= 1.0
    assert one.position_deg == pytest.approx(one.end_deg, abs=0.1)


def table_behind(client: TableClient) -> SimulatedBench:
    table = bench_of(client.port)
    assert table is not None
    return table


def table_at_rest(
    url: str = "emulator://", decimals: int = 1, rate: float = HARDEST, baud: int = 9600
) -> tuple[TableClient, SimulatedBench]:
    """Return a table that rests, and has accepted its maximum S and A."""
    client = TableClient.open(url, baud or 9600, decimals=decimals)
    client.set_speed(FASTEST)
    client.set_acceleration(rate)
    client.move_to(0)
    client.wait_until_at(0)
    return client, table_behind(client)


@pytest.mark.parametrize("acceleration", [0.1, 1.0, 5.0, 20.0, 100.0])
@pytest.mark.parametrize("after_s", [0.05, 1.0, 6.0, 30.0])
def test_it_stands_as_soon_as_it_can_whatever_acceleration_is_in_force(acceleration: float, after_s: float) -> None:
    client, table = table_at_rest()
    client.set_acceleration(acceleration)
    client.move_to(1200)
    client.clock.sleep_s(after_s)
    check(stopped(client, table))


@pytest.mark.parametrize("speed", [0.1, 1.0, 10.0, 40.0])
def test_a_low_top_speed_does_not_make_it_creep(speed: float) -> None:
    client, table = table_at_rest()
    client.set_speed(speed)
    client.move_to(300)
    client.clock.sleep_s(2.0)
    check(stopped(client, table))


def test_the_speed_may_just_have_been_lowered() -> None:
    client, table = table_at_rest()
    client.move_to(300)
    client.clock.sleep_s(2.0)
    client.set_speed(0.1)
    client.set_acceleration(0.1)
    client.move_to(300)
    client.clock.sleep_s(0.1)
    check(stopped(client, table))


def test_a_table_that_turns_back_is_stopped_on_its_way_back() -> None:
    client, table = table_at_rest()
    client.set_acceleration(10.0)
    client.move_to(100)
    client.clock.sleep_s(3.0)
    client.move_to(0)
    for wait_s in (0.5, 3.5):
        client.clock.sleep_s(wait_s)
        client.clock.sleep_s(0.0)
    assert table.status().reference_speed_deg_s < 0
    check(stopped(client, table))


def test_a_table_at_rest_is_not_moved() -> None:
    client, table = table_at_rest()
    client.move_to(12.3)
    client.wait_until_at(12.3)
    client.clock.sleep_s(1.0)
    before = table.status().true_deg
    one = stopped(client, table)
    assert one.way_deg == one.back_deg == 0.0
    assert table.status().true_deg == before


def test_speed_and_acceleration_are_what_they_were_before() -> None:
    client, table = table_at_rest()
    client.set_speed(7.0)
    client.set_acceleration(3.0)
    client.move_to(50)
    client.clock.sleep_s(1.0)
    client.stop()
    begun_s = client.clock.now_s()
    client.move_by(21.0)
    client.clock.sleep_s(2.0)
    assert table.status().reference_speed_deg_s == pytest.approx(6.0, abs=0.2)
    assert client.clock.now_s() - begun_s < 3.0


@pytest.mark.parametrize("speed", [1.0, 5.0, 12.0, 20.0, 40.0])
@pytest.mark.parametrize("decimals", [1, 3])
def test_a_motion_of_which_nothing_is_known_is_stopped_too(speed: float, decimals: int) -> None:
    other, table = table_at_rest(f"emulator://?decimals={decimals}")
    other.set_speed(speed)
    other.move_to(1000)
    other.clock.sleep_s(1.5)
    check(stopped(TableClient(other.port, decimals=decimals), table))


def test_a_table_that_refuses_the_acceleration_asked_for_is_stopped_with_less(tmp_path: Path) -> None:
    config = tmp_path / "table.toml"
    config.write_text("[limits]\nacceleration_deg_s2 = 30.0\n")
    client = TableClient.open(f"emulator://?config={config}")
    client.set_speed(FASTEST)
    client.move_to(1000)
    client.clock.sleep_s(4.0)
    one = stopped(client, table_behind(client), 25.0)
    assert one.beyond_deg <= 1.0
    assert one.back_deg <= 1.0


@settings(max_examples=60)
@given(data=st.data())
def test_any_motion_on_any_table_is_stopped(data: st.DataObject, tmp_path_factory: pytest.TempPathFactory) -> None:
    draw = data.draw
    rate = draw(st.sampled_from([10.0, 40.0, 100.0]), "greatest A")
    baud = draw(st.sampled_from([0, 4800, 9600, 19200, 115200]), "baud")
    decimals = draw(st.integers(1, 4), "decimals")
    config = tmp_path_factory.mktemp("table") / "table.toml"
    config.write_text(f"[limits]\nacceleration_deg_s2 = {rate}\n[power_on]\nacceleration_deg_s2 = {min(rate, 20.0)}\n")
    client, table = table_at_rest(f"emulator://?config={config}&baud={baud}&decimals={decimals}", decimals, rate, baud)
    for _ in range(draw(st.integers(1, 5), "motions")):
        client.set_speed(draw(st.integers(1, 400)) / 10)
        client.set_acceleration(draw(st.integers(1, round(10 * rate))) / 10)
        client.move_to(draw(st.integers(-3000, 3000)) / 10)
        client.clock.sleep_s(draw(st.integers(0, 5000)) / 1000)
    one = stopped(client, table, rate)
    late_deg = 0.03 * one.speed_deg_s if baud == 4800 else 0.0  # the lines take twice as long
    assert one.beyond_deg <= 1.0 + late_deg
    assert one.beyond_s <= 0.5
    assert one.back_deg <= 1.0


@pytest.mark.parametrize("line", [b"A 0.1\r", b"A 100.0\r", b"S 0.1\r", b"P -300.0\r"])
@pytest.mark.parametrize("share", [0.0, 0.5, 1.0])
def test_an_interrupt_as_a_line_is_written_leaves_open_whether_the_table_has_it(line: bytes, share: float) -> None:
    client, table = table_at_rest()
    client.move_to(300)
    client.clock.sleep_s(2.0)
    port = client.port
    write = port.write

    def interrupted(data: bytes) -> None:
        port.write = write  # type: ignore[method-assign]  # as it was
        write(data[: round(share * len(data))])
        raise KeyboardInterrupt

    port.write = interrupted  # type: ignore[method-assign]  # for one line
    send = {b"A": client.set_acceleration, b"S": client.set_speed, b"P": client.move_to}[line[:1]]
    with pytest.raises(KeyboardInterrupt):
        send(float(line[2:]))
    check(stopped(client, table))


@pytest.mark.parametrize("lost", [b"A 100.0\r", b"S 40.0\r"])
def test_a_setting_of_the_stop_that_is_lost_is_sent_again(lost: bytes) -> None:
    client, table = table_at_rest()
    client.set_acceleration(0.5)
    client.set_speed(39.0)
    client.move_to(1000)
    client.clock.sleep_s(30.0)
    port = client.port
    write, losses = port.write, [lost]

    def lossy(data: bytes) -> int | None:
        return write(data.replace(losses.pop(), b"") if losses and losses[0] in data else data)

    port.write = lossy  # type: ignore[method-assign]  # loses one line
    one = stopped(client, table)
    assert not losses
    assert one.rest_s < 10.0  # 30 at the A that was in force


def test_a_dead_line_is_told_with_what_the_table_will_do() -> None:
    client, table = table_at_rest()
    client.set_acceleration(5)
    client.move_to(300)
    client.clock.sleep_s(2.0)
    table.inject(fault_from("hang-up", {}))
    with pytest.raises(
        NotStopped,
        match=r"the device has disappeared.*it continues to its last target, 300 deg, and stops there within 13\.\d s$",
    ):
        client.stop()


def test_a_silent_table_is_told_and_has_heard_the_stop() -> None:
    client, table = table_at_rest()
    client.move_to(300)
    client.clock.sleep_s(2.0)
    before = table.status().reference_deg
    table.inject(fault_from("silence", {}))
    with pytest.raises(NotStopped, match=r"no reply to it within 1 s.*its last target, 300 deg"):
        client.stop()
    assert table.status().state == "idle"
    assert before + 8 <= table.status().reference_deg <= before + 9


def test_the_stop_is_carried_out_though_its_first_replies_are_lost() -> None:
    client, table = table_at_rest()
    client.move_to(300)
    client.clock.sleep_s(2.0)
    table.inject(fault_from("silence", {"for_s": 0.7}))
    one = stopped(client, table)
    check(one)


@pytest.mark.parametrize("delay_s", [0.1, 0.5, 0.9])
@pytest.mark.parametrize("decimals", [1, 3])
def test_a_table_that_answers_late_is_stopped_as_soon(delay_s: float, decimals: int) -> None:
    client, table = table_at_rest(f"emulator://?decimals={decimals}", decimals)
    table.inject(fault_from("delay", {"seconds": delay_s}))
    client.set_acceleration(20)
    client.move_to(300)
    client.clock.sleep_s(3.0)
    check(stopped(client, table))


def test_a_stalled_table_is_not_pushed_on() -> None:
    client, table = table_at_rest()
    client.set_speed(20)
    client.move_to(300)
    client.clock.sleep_s(1.0)
    table.inject(fault_from("stall", {}))
    for _ in range(20):
        client.position_deg()
        client.clock.sleep_s(0.05)
    before = table.status().true_deg
    table.clear_faults()
    assert client.stop() == pytest.approx(before, abs=0.3)
    assert table.status().true_deg == pytest.approx(before, abs=0.3)


def test_a_target_that_was_not_sent_is_not_told() -> None:
    client, table = table_at_rest()
    client.set_acceleration(5)
    client.move_to(300)
    client.clock.sleep_s(2.0)
    table.inject(fault_from("hang-up", {}))
    with pytest.raises(PortError):
        client.move_to(500)
    with pytest.raises(NotStopped, match="its last target, 300 deg"):
        client.stop()
