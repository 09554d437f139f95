"""A small share of the benchmark's stops, as tests."""

from tools.bench.stop import stops_along
from tools.bench.virtual_run import random_run_inputs, shipped_run_input


def test_a_stop_amid_a_shipped_plan_keeps_what_is_promised() -> None:
    moments = stops_along(shipped_run_input("cylinder"), every=700)
    assert len(moments) > 10
    assert [each.stopped for each in moments if not each.stopped.is_right] == []
    assert max(each.cut_off.from_told_deg for each in moments) < 0.1


def test_a_stop_amid_a_random_plan_keeps_what_is_promised() -> None:
    moments = [each for run_input in random_run_inputs(1) for each in stops_along(run_input, every=200)]
    assert len(moments) > 10
    assert [each.stopped for each in moments if not each.stopped.is_right] == []
