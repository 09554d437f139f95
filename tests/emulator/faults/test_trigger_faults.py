"""The effect of a trigger fault on the latch."""

import pytest

from tests.emulator.fault_bench import Bench


def test_a_missed_trigger_leaves_the_latch(bench: Bench) -> None:
    bench.move(10)
    bench.inject("missed-trigger", probability=1.0)
    bench.table.trigger()
    assert bench.client.latched_deg() == 0.0
    bench.table.clear_faults()
    bench.table.trigger()
    assert bench.client.latched_deg() == 10.0


@pytest.mark.parametrize("fraction", [0.0, 0.5])
def test_a_bounced_trigger_latches_a_later_position(fraction: float) -> None:
    bench = Bench()
    bench.move(60, 2.0)
    bench.inject("bounced-trigger", edges=3, within_s=0.2)
    at_edge = bench.table.status().encoder_deg
    bench.table.trigger(fraction)
    bench.client.clock.sleep_s(0.3)
    assert at_edge + 0.3 < bench.client.latched_deg() < at_edge + 4.1  # 0.2 s at 20 deg/s
