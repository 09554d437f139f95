"""The table as its client knows it: bytes in, bytes out, and where it stands."""

import math
import random
from collections.abc import Iterator
from dataclasses import replace
from fractions import Fraction
from itertools import pairwise

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from emulator.config import TableConfig, load_config
from emulator.encoder import count_at
from emulator.profiler import Reference
from emulator.status import TableStatus
from emulator.table import Table
from protocol.line_buffer import LineBuffer

PACED = load_config()
UNPACED = PACED.with_serial(baud=0, decimals=6)
REST_DEG = 0.05


def ask(table: Table, *lines: str) -> bytes:
    """Send lines on an unpaced line and return what is answered at once."""
    table.receive("".join(f"{line}\r" for line in lines).encode())
    return table.transmit()


def move(table: Table, *lines: str) -> TableStatus:
    """Send lines and wait until the table stands; they must all be accepted."""
    assert set(ask(table, *lines).split()) == {b"OK"}
    return until_at_rest(table)


def until_at_rest(table: Table) -> TableStatus:
    for _ in range(1000):
        table.advance(100)
        if table.status().state in {"idle", "stalled"}:
            table.advance(100)  # let it run out
            return table.status()
    raise AssertionError(f"still on its way: {table.status()}")


def statuses(table: Table, ticks: int) -> Iterator[TableStatus]:
    for _ in range(ticks):
        table.advance(1)
        yield table.status()


def with_gears_and_friction(backlash_arcmin: float, total_friction_Nm: float) -> TableConfig:
    gears = replace(UNPACED.gears, backlash_arcmin=backlash_arcmin)
    bearing_Nm = UNPACED.table.bearing_friction_Nm / (gears.ratio * gears.efficiency)
    friction = replace(UNPACED.friction, coulomb_Nm=total_friction_Nm - bearing_Nm)
    return replace(UNPACED, gears=gears, friction=friction)


class TestPositioning:
    @pytest.mark.parametrize("angle_deg", [0.1, 1.0, 9.9, 90.0, 720.0])
    @pytest.mark.parametrize("motion", [("S 40", "A 100"), ("S 10", "A 20"), ("S 3", "A 100"), ("S 40", "A 15")])
    def test_both_ways_the_table_comes_to_rest_at_its_target(self, angle_deg: float, motion: tuple[str, str]) -> None:
        if angle_deg / float(motion[0][2:]) > 30.0:
            motion = ("S 40", "A 100")  # a slow way this long shows nothing more
        table = Table(UNPACED, seed=round(angle_deg * 10))
        for target_deg in (angle_deg, 0.0, -angle_deg):
            status = move(table, *motion, f"P {target_deg}")
            assert status.state == "idle"
            assert status.reference_deg == pytest.approx(target_deg, abs=1e-6)
            assert abs(status.encoder_deg - target_deg) <= REST_DEG

    @pytest.mark.parametrize("backlash_arcmin", [2.0, 10.0, 60.0])
    @pytest.mark.parametrize("total_friction_Nm", [0.6e-3, 1.5e-3, 4.2e-3])
    @pytest.mark.parametrize("seed", range(2))
    def test_over_the_whole_range_of_friction_and_backlash(
        self, backlash_arcmin: float, total_friction_Nm: float, seed: int
    ) -> None:
        table = Table(with_gears_and_friction(backlash_arcmin, total_friction_Nm), seed)
        chance, target_deg = random.Random(seed), 0.0  # noqa: S311  # a test's draw
        for _ in range(5):
            increment_deg = round(chance.choice([-1.0, 1.0]) * 10 ** chance.uniform(-1.0, 1.5), 1)
            target_deg += increment_deg
            status = move(
                table, f"S {chance.uniform(5, 40):.1f}", f"A {chance.uniform(10, 100):.1f}", f"R {increment_deg}"
            )
            assert status.state == "idle"
            assert abs(status.encoder_deg - target_deg) <= REST_DEG
            assert abs(status.true_deg - status.encoder_deg) <= backlash_arcmin / 60.0 + REST_DEG

    @pytest.mark.parametrize(("increment_deg", "times"), [(10.0, 36), (0.1, 100), (-0.1, 100)])
    def test_increments_at_rest_add_up_exactly(self, increment_deg: float, times: int) -> None:
        table = Table(UNPACED, seed=4)
        for _ in range(times):
            status = move(table, "S 40", "A 100", f"R {increment_deg}")
        assert status.reference_deg == pytest.approx(times * increment_deg, abs=1e-5)
        assert abs(status.encoder_deg - times * increment_deg) <= REST_DEG

    def test_a_position_is_absolute_on_the_unwrapped_axis(self) -> None:
        table = Table(UNPACED)
        assert move(table, "S 40", "A 100", "P 370").encoder_deg == pytest.approx(370.0, abs=REST_DEG)
        assert move(table, "P 10").encoder_deg == pytest.approx(10.0, abs=REST_DEG)


class TestPreEmption:
    @pytest.mark.parametrize("seed", range(5))
    def test_the_references_speed_is_continuous(self, seed: int) -> None:
        """Fig. 4: whatever comes and whenever, the speed changes by at most A a tick, from where it was."""
        chance, table = random.Random(seed), Table(UNPACED, seed)  # noqa: S311  # a test's draw
        before = table.status()
        for _ in range(12):
            acceleration_deg_s2 = chance.randint(5, 100)
            verb = chance.choice("PR")
            assert (
                ask(
                    table, f"S {chance.randint(1, 40)}", f"A {acceleration_deg_s2}", f"{verb} {chance.randint(-40, 40)}"
                )
                == b"OK\r" * 3
            )
            for status in statuses(table, chance.randint(1, 700)):
                change_deg_s = status.reference_speed_deg_s - before.reference_speed_deg_s
                assert abs(change_deg_s) <= acceleration_deg_s2 / 1000 + 1e-4  # the registers' rounding
                mean_speed_deg_s = (status.reference_speed_deg_s + before.reference_speed_deg_s) / 2
                way_deg = status.reference_deg - before.reference_deg
                assert way_deg == pytest.approx(mean_speed_deg_s / 1000, abs=acceleration_deg_s2 / 4e6 + 1e-6)
                before = status

    def test_speed_and_acceleration_wait_for_the_next_motion(self) -> None:
        plain, interrupted = Table(UNPACED), Table(UNPACED)
        for table in (plain, interrupted):
            ask(table, "S 20", "A 50", "R 30")
            table.advance(500)
        ask(interrupted, "S 5", "A 10")
        plain.advance(1000)
        interrupted.advance(1000)
        assert interrupted.snapshot().state == plain.snapshot().state
        ask(interrupted, "R 100")
        interrupted.advance(3000)
        assert interrupted.status().reference_speed_deg_s == pytest.approx(5.0, abs=1e-6)

    def test_r_0_in_motion_brakes_and_comes_back(self) -> None:
        table = Table(UNPACED)
        ask(table, "S 20", "A 50", "R 90")
        table.advance(1500)
        here_deg = table.status().reference_deg
        assert ask(table, "R 0") == b"OK\r"
        farthest_deg = max(status.reference_deg for status in statuses(table, 1000))
        status = until_at_rest(table)
        assert farthest_deg == pytest.approx(here_deg + 20**2 / (2 * 50), abs=0.001)
        assert status.reference_deg == pytest.approx(here_deg, abs=1e-6)
        assert abs(status.encoder_deg - here_deg) <= REST_DEG

    def test_a_lower_speed_is_reached_by_braking_at_the_new_acceleration(self) -> None:
        table = Table(UNPACED)
        ask(table, "S 40", "A 100", "P 300")
        table.advance(1000)
        ask(table, "S 10", "A 20", "P 300")
        speeds = [status.reference_speed_deg_s for status in statuses(table, 1600)]
        assert speeds[0] == pytest.approx(40.0 - 0.02, abs=1e-4)
        assert speeds[1499] == pytest.approx(10.0, abs=0.02)
        assert speeds[-1] == pytest.approx(10.0, abs=1e-6)


class TestTheWire:
    @pytest.mark.parametrize(
        ("line", "reply"),
        [
            (b"X 1", b"ERR 1 unknown command"),
            (b"h", b"ERR 1 unknown command"),
            (b"P", b"ERR 2 bad number"),
            (b"P 1e400", b"ERR 2 bad number"),
            (b"P nan", b"ERR 2 bad number"),
            (b"P --5", b"ERR 2 bad number"),
            (b"P 5.", b"ERR 2 bad number"),
            (b"P .5", b"ERR 2 bad number"),
            (b"H 1", b"ERR 2 bad number"),
            (b"P 99999999999999", b"ERR 3 out of range"),
            (b"R -99999999999999", b"ERR 3 out of range"),
            (b"S 0", b"ERR 3 out of range"),
            (b"S -1", b"ERR 3 out of range"),
            (b"S 40.1", b"ERR 3 out of range"),
            (b"A 0.0", b"ERR 3 out of range"),
            (b"A 100.000001", b"ERR 3 out of range"),
            (b"P " + b"0" * 31, b"ERR 4 line too long"),
            (b"P 1\x00", b"ERR 5 bad byte"),
            (b"\xff", b"ERR 5 bad byte"),
            (b"P +5", b"OK"),
            (b"P" + b"0" * 30 + b"5", b"OK"),
            (b"\nS\n 40.0 \n", b"OK"),
        ],
    )
    def test_each_line_has_its_reply(self, line: bytes, reply: bytes) -> None:
        table = Table(UNPACED)
        table.receive(line + b"\r")
        assert table.transmit() == reply + b"\r"

    @pytest.mark.parametrize("line", [b"", b"   ", b"\n", b"\r\n\r\n"])
    def test_an_empty_line_has_none(self, line: bytes) -> None:
        table = Table(UNPACED)
        table.receive(line + b"\r")
        assert table.transmit() == b""

    def test_strict_table_1_has_no_error_replies(self) -> None:
        table = Table(UNPACED.with_serial(strict=True))
        assert ask(table, "X", "P x", "S 99", "H") == b"H 0.000000\r"

    def test_an_angle_has_the_decimals_that_are_configured_and_no_negative_zero(self) -> None:
        table = Table(UNPACED.with_serial(decimals=1))
        assert ask(table, "H", "L") == b"H 0.0\rL 0.0\r"
        move(table, "S 40", "A 100", "P -0.04")
        assert table.status().encoder_deg < 0.0
        assert ask(table, "H") == b"H 0.0\r"
        move(table, "P -725.3")
        assert ask(table, "H").startswith(b"H -725.")

    @settings(max_examples=60, deadline=None)
    @given(
        data=st.lists(
            st.sampled_from(
                [b"H\r", b"L\r", b"S 400\r", b"P 1e9\r", b"A 0\r", b"\r", b"\n", b"R\r", b"\x00", b"\xff\r"]
            )
            | st.binary(max_size=40).filter(lambda data: not set(b"PRSA") & set(data))
        ).map(b"".join),
        cuts=st.lists(st.integers(0, 400), max_size=6),
    )
    def test_whatever_comes_is_answered_line_by_line_and_leaves_the_motion_alone(
        self, data: bytes, cuts: list[int]
    ) -> None:
        """At any split of the bytes; no line of these moves the table."""
        undisturbed, table = Table(UNPACED), Table(UNPACED)
        for moving in (undisturbed, table):
            ask(moving, "S 20", "A 50", "R 30")
            moving.advance(50)
        cuts = sorted({0, *(min(cut, len(data)) for cut in cuts), len(data)})
        for start, end in pairwise(cuts):
            table.receive(data[start:end])
        replies = table.transmit()
        assert replies.count(b"\r") == len(LineBuffer().feed(data))
        undisturbed.advance(50)
        table.advance(50)
        assert table.snapshot().state == undisturbed.snapshot().state

    def test_the_line_is_paced_both_ways(self) -> None:
        """At 9600 baud `H` and its CR take 2.08 ms, the 6 bytes of the reply 6.25 ms more, each to the tick."""
        table = Table(PACED)
        table.receive(b"H\r")
        heard = [table.transmit() for _ in statuses(table, 12)]
        assert b"".join(heard) == b"H 0.0\r"
        assert [tick for tick, byte in enumerate(heard, start=1) if byte] == [
            3 + math.ceil(n / 0.96) for n in range(1, 7)
        ]

    def test_a_half_line_goes_with_the_client_that_began_it(self) -> None:
        for config in (PACED, UNPACED):
            table = Table(config)
            table.receive(b"P 9")
            table.advance(10)
            table.disconnect()
            table.receive(b"H\r")
            table.advance(30)
            assert table.transmit().startswith(b"H 0.0")

    @settings(max_examples=12, deadline=None)
    @given(lines=st.lists(st.integers(1, 3999), min_size=30, max_size=80), pause=st.integers(0, 15))
    def test_a_client_that_outruns_the_line_never_moves_the_table_by_a_damaged_line(
        self, lines: list[int], pause: int
    ) -> None:
        """Each S sets a speed that no other line can be cut to: what is set was sent, and every reply is whole."""
        table, sent, seen, replies = Table(PACED), set(), set(), b""
        for number in lines:
            text = f"{number / 100:.2f}"
            sent.add(Fraction(text))
            table.receive(f"H\rH\rH\rS {text}\r".encode())
            for _ in range(pause):
                table.advance(1)
                seen.add(table.snapshot().registers.speed)
                replies += table.transmit()
        for _ in range(200):
            table.advance(10)
            seen.add(table.snapshot().registers.speed)
            replies += table.transmit()
        registers = {round(speed * 512 / 1000 * 2**26) for speed in sent | {Fraction(10)}}
        assert seen <= registers
        assert set(replies.split(b"\r")) <= {b"", b"OK", b"H 0.0", b"ERR 5 bad byte"}
        if pause == 0:
            assert table.status().lost_bytes > 0


class TestTheLatch:
    def test_before_any_trigger_it_holds_the_position_at_power_on(self) -> None:
        table = Table(UNPACED)
        move(table, "S 40", "A 100", "P 5")
        assert ask(table, "L") == b"L 0.000000\r"

    def test_reading_it_does_not_clear_it_and_a_trigger_overwrites_it(self) -> None:
        table = Table(UNPACED)
        ask(table, "S 20", "A 50", "R 30")
        table.advance(700)
        table.trigger()
        first = ask(table, "L")
        table.advance(100)
        assert first == ask(table, "L") != b"L 0.000000\r"
        table.trigger()
        assert ask(table, "L") != first

    @pytest.mark.parametrize("fraction", [0.0, 0.25, 0.999])
    def test_it_is_exact_to_one_count_at_any_speed(self, fraction: float) -> None:
        """Against the straight line between the angles at both ends of the tick, over a motion to 40 deg/s and back."""
        table = Table(UNPACED)
        ask(table, "S 40", "A 100", "R 10")
        for _ in range(120):
            table.advance(10)
            before = table.snapshot()
            table.trigger(fraction)
            table.advance(1)
            after = table.snapshot()
            start, end = before.state.drive.angle_rad, after.state.drive.angle_rad
            expected = count_at(before.constants.encoder, start + fraction * (end - start))
            assert abs(after.registers.latched_count - expected) <= (1 if fraction else 0)

    def test_a_periodic_trigger_latches_at_its_rate(self) -> None:
        """Every 2.5 ms: the latch moves in the ticks that bear an edge, to where the table was at it."""
        table = Table(UNPACED)
        ask(table, "S 40", "A 100", "R 100")
        table.advance(1000)
        table.trigger_hz = 400.0
        latched = [status.latched_deg for status in statuses(table, 20)]
        changes = [tick for tick in range(1, 20) if latched[tick] != latched[tick - 1]]
        assert changes == [2, 5, 7, 10, 12, 15, 17]
        assert [latched[b] - latched[a] for a, b in pairwise(changes)] == pytest.approx([0.1] * 6, abs=3 / 512)


class TestDeterminism:
    SCRIPT = ((0, b"S 20\rA 50\rR 3"), (37, b"0\rH\r"), (400, b"H\rL\rR -5\r"), (900, b"junk\r\xff\rH\rS 5\rP 1\r"))
    END = 2500

    def play(self, table: Table, steps: Iterator[int]) -> tuple[bytes, str]:
        """Send the script at its ticks, with time cut into steps; return the replies and the last state."""
        replies, events = b"", [*self.SCRIPT, (self.END, b"")]
        for (tick, data), (next_tick, _) in pairwise(events):
            assert table.tick == tick
            table.receive(data)
            while table.tick < next_tick:
                table.advance(min(next(steps), next_tick - table.tick))
                replies += table.transmit()
        snapshot = table.snapshot()
        return replies, repr((snapshot.tick, snapshot.state, snapshot.registers, snapshot.load_torque_Nm))

    @pytest.mark.parametrize("config", [PACED, UNPACED], ids=["paced", "unpaced"])
    @pytest.mark.parametrize("trigger_hz", [0.0, 130.0])
    @pytest.mark.parametrize("observed", [False, True])
    def test_how_time_is_cut_changes_nothing(self, config: TableConfig, trigger_hz: float, observed: bool) -> None:
        def fresh() -> Table:
            table = Table(config, seed=8)
            table.trigger_hz = trigger_hz
            return table

        whole = self.play(fresh(), iter(lambda: self.END, None))
        chance = random.Random(1)  # noqa: S311  # a test's draw
        cut = fresh()
        cut.observer = (lambda _status, _heard, _said: None) if observed else None
        assert self.play(cut, iter(lambda: chance.randint(0, 40), None)) == whole

    def test_the_seed_alone_tells_two_runs_apart(self) -> None:
        runs = [self.play(Table(PACED, seed), iter(lambda: 100, None)) for seed in (5, 5, 6)]
        assert runs[0] == runs[1]
        assert runs[0][1] != runs[2][1]

    def test_a_restored_table_goes_on_as_if_nothing_had_been(self) -> None:
        table = Table(PACED, seed=2)
        table.trigger_hz = 77.0
        table.set_load_torque(0.2)
        table.receive(b"S 20\rA 50\rR 30\rH\r")
        table.advance(17)  # in the middle of a byte
        snapshot = table.snapshot()
        futures = []
        for _ in range(2):
            table.restore(snapshot)
            table.receive(b"L\r")
            table.trigger(0.5)
            table.advance(800)
            futures.append((table.transmit(), repr(table.snapshot().state), table.status()))
        assert futures[0] == futures[1]

    def test_rest_is_skipped_without_a_trace(self) -> None:
        """A day at rest, and a table that was watched tick by tick, end in the same state."""
        skipping, watched = Table(UNPACED, seed=1), Table(UNPACED, seed=1)
        watched.observer = lambda _status, _heard, _said: None
        for table in (skipping, watched):
            move(table, "S 40", "A 100", "P 1")
        skipping.advance(86_400_000)
        watched.advance(2000)
        assert repr(skipping.snapshot().state) == repr(watched.snapshot().state)
        for table in (skipping, watched):
            table.set_load_torque(3.0)  # drives the motor backwards through the gears
            table.advance(500)
        assert skipping.snapshot().state == watched.snapshot().state
        assert skipping.status().true_deg < 1.0

    def test_what_was_said_before_anybody_watched_is_not_kept(self) -> None:
        table, seen = Table(load_config().with_serial(baud=0)), []
        table.receive(b"H\r")
        table.observer = lambda _status, heard, said: seen.append((heard, said))
        table.advance(1)
        assert seen == [(b"", b"")]

    def test_the_observer_sees_each_tick_and_each_byte(self) -> None:
        table, seen = Table(PACED), []
        table.observer = lambda status, heard, said: seen.append((status.tick, heard, said))
        table.receive(b"H\r")
        table.advance(20)
        assert [tick for tick, _, _ in seen] == list(range(1, 21))
        assert b"".join(heard for _, heard, _ in seen) == b"H\r"
        assert b"".join(said for _, _, said in seen) == table.transmit() == b"H 0.0\r"


class TestTheEndsOfTheCounter:
    def near_the_end(self) -> Table:
        """Return a table that stands 100 counts below the counter's end."""
        table = Table(UNPACED)
        snapshot, count = table.snapshot(), 2**31 - 100
        drive, controller = snapshot.state.drive, snapshot.state.firmware
        turned_rad = count / snapshot.constants.encoder.count_rad
        drive = drive._replace(angle_rad=turned_rad, table_angle_rad=turned_rad / 480)
        controller = controller._replace(reference=Reference(count, 0, 0, 0, 0), counts=(count,) * 8)
        table.restore(snapshot._replace(state=snapshot.state._replace(drive=drive, firmware=controller)))
        return table

    def test_a_motion_over_the_end_of_the_counter_arrives(self) -> None:
        table = self.near_the_end()
        status = move(table, "S 40", "A 100", "R 10")
        target_deg = (2**31 - 100 - 2**32) / 512 + 10
        assert status.state == "idle"
        assert status.encoder_deg == pytest.approx(target_deg, abs=REST_DEG)
        assert math.isclose(status.true_deg, (2**31 - 100) / 512 + 10, abs_tol=0.2)
        assert move(table, "R -10").encoder_deg == pytest.approx((2**31 - 100) / 512, abs=REST_DEG)

    @pytest.mark.parametrize("line", ["P 4194304", "P -4194304", "R 4194304", "R -99999999"])
    def test_a_position_beyond_the_counter_is_refused(self, line: str) -> None:
        table = Table(UNPACED)
        before = table.snapshot()
        assert ask(table, line) == b"ERR 3 out of range\r"
        assert table.snapshot().state == before.state

    def test_the_last_positions_before_it_are_not(self) -> None:
        assert ask(Table(UNPACED), "P 4194303.9") == b"OK\r"
        assert ask(Table(UNPACED), "P -4194303.9") == b"OK\r"


class TestFromOutside:
    def test_a_jammed_table_is_switched_off_says_so_and_recovers(self) -> None:
        jam = replace(UNPACED.table, bearing_friction_Nm=100.0)
        table, free = Table(replace(UNPACED, table=jam)), Table(UNPACED)
        ask(table, "S 20", "A 50", "R 30")
        status = until_at_rest(table)
        assert (status.state, status.duty, status.reference_speed_deg_s) == ("stalled", 0.0, 0.0)
        assert status.reference_deg == status.encoder_deg
        assert abs(status.encoder_deg) < 10.0 / 60.0, "only the motor turned, in the gap"
        free.restore(table.snapshot()._replace(constants=free.snapshot().constants))
        assert move(free, "P 30").encoder_deg == pytest.approx(30.0, abs=REST_DEG)

    def test_a_reset_wakes_the_controller_at_zero_where_the_plant_is(self) -> None:
        table = Table(UNPACED)
        move(table, "S 40", "A 100", "P 33.3")
        table.trigger()
        table.reset()
        assert ask(table, "H", "L") == b"H 0.000000\rL 0.000000\r"
        assert abs(table.status().true_deg) <= 5.0 / 60.0 + 1e-9, "but for the backlash"
        assert move(table, "P 5").encoder_deg == pytest.approx(5.0, abs=REST_DEG)
        ask(table, "R 360")
        table.advance(3000)
        assert table.status().reference_speed_deg_s == pytest.approx(10.0, abs=1e-6), "S is that of power-on again"

    def test_a_steady_load_does_not_move_where_it_comes_to_rest(self) -> None:
        for load_torque_Nm in (-0.3, 0.3):
            table = Table(UNPACED)
            table.set_load_torque(load_torque_Nm)
            assert move(table, "S 20", "A 50", "P 12").encoder_deg == pytest.approx(12.0, abs=REST_DEG)

    def test_misuse_is_refused(self) -> None:
        table = Table(UNPACED)
        with pytest.raises(ValueError, match="cannot go back by 1 ticks"):
            table.advance(-1)
        with pytest.raises(ValueError, match="outside"):
            table.trigger(1.0)
        with pytest.raises(ValueError, match="not finite"):
            table.set_load_torque(math.nan)
