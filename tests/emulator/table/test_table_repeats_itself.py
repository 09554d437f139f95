"""The same configuration, seed, bytes and ticks give the same table, however the time is divided."""

import random
from collections.abc import Iterator
from itertools import pairwise

import pytest

from emulator.config.table_config import TableConfig, load_config
from emulator.table.table import Table
from tests.emulator.table_bench import PACED, UNPACED, move


class TestDeterminism:
    SCRIPT = ((0, b"S 20\rA 50\rR 3"), (37, b"0\rH\r"), (400, b"H\rL\rR -5\r"), (900, b"junk\r\xff\rH\rS 5\rP 1\r"))
    END = 2500

    def play(self, table: Table, steps: Iterator[int]) -> tuple[bytes, str]:
        """Send the script at its ticks, with the time divided into steps; return the replies and the last state."""
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
        """A day at rest, and a table that is observed tick by tick, end in the same state."""
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
