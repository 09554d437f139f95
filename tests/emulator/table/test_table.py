"""Inputs of the table besides the wire: the probe's trigger, and the actions of the bench."""

import math
from dataclasses import replace
from itertools import pairwise

import pytest

from emulator.plant.encoder import count_at
from emulator.table.table import Table
from tests.emulator.table_bench import REST_DEG, UNPACED, ask, move, statuses, until_at_rest


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
        """Compared with the straight line between the angles at the ends of the tick, in a motion to 40 deg/s."""
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
        """Every 2.5 ms: the latch changes in the ticks with an edge, to the position of the table at the edge."""
        table = Table(UNPACED)
        ask(table, "S 40", "A 100", "R 100")
        table.advance(1000)
        table.trigger_hz = 400.0
        latched = [status.latched_deg for status in statuses(table, 20)]
        changes = [tick for tick in range(1, 20) if latched[tick] != latched[tick - 1]]
        assert changes == [2, 5, 7, 10, 12, 15, 17]
        assert [latched[b] - latched[a] for a, b in pairwise(changes)] == pytest.approx([0.1] * 6, abs=3 / 512)


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
