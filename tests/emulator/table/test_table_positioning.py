"""The rest position of a table, and its motion through one command after another."""

import math
import random
from dataclasses import replace

import pytest

from emulator.config.table_config import TableConfig
from emulator.firmware.profiler import Reference
from emulator.table.table import Table
from tests.emulator.table_bench import REST_DEG, UNPACED, ask, move, statuses, until_at_rest


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
        """Fig. 4: for any commands at any time, the speed changes by at most A per tick, from its present value."""
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

    @pytest.mark.parametrize("line", ["P 4194304", "P -4194304.001", "R 4194304.001", "R -99999999"])
    def test_a_position_beyond_the_counter_is_refused(self, line: str) -> None:
        table = Table(UNPACED)
        before = table.snapshot()
        assert ask(table, line) == b"ERR 3 out of range\r"
        assert table.snapshot().state == before.state

    @pytest.mark.parametrize("line", ["P 4194303.998", "P -4194304", "R 4194304", "R -4194304"])
    def test_the_last_positions_before_it_and_half_of_its_range_are_not(self, line: str) -> None:
        table = Table(UNPACED)
        assert ask(table, line) == b"OK\r"
        table.advance(2000)
        travelled_deg = table.status().reference_deg
        assert travelled_deg > 10 if line[2] == "4" else travelled_deg < -10

    @pytest.mark.parametrize("direction", [1, -1])
    def test_a_motion_of_half_the_range_ends_where_it_should(self, direction: int) -> None:
        """The last part of the motion, from a preset counter; the target is the first position in both cases."""
        table = Table(UNPACED)
        table.reset(-(2**31) + 512 * 5)
        assert move(table, "S 40", "A 100", "P -4194304").encoder_deg == pytest.approx(-4194304, abs=REST_DEG)
        table.reset(0)
        assert ask(table, f"R {direction * 4194304}") == b"OK\r"
        assert ask(table, "P 3") == b"OK\r"
        assert until_at_rest(table).encoder_deg == pytest.approx(3, abs=REST_DEG)
