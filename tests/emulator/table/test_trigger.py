from fractions import Fraction

import pytest
from hypothesis import given
from hypothesis import strategies as st

from emulator.faults.schedule import FaultSchedule
from emulator.table.trigger import TriggerInput

TICK_HZ = 1000


def sound_input() -> TriggerInput:
    return TriggerInput(TICK_HZ, FaultSchedule((), TICK_HZ, seed=0))


def edges(trigger: TriggerInput, ticks: range) -> list[float]:
    """Return the instants, in ticks, of all edges that come within some ticks."""
    found = []
    for tick in ticks:
        while (fraction := trigger.take(tick)) is not None:
            found.append(tick + fraction)
    return found


def test_a_silent_input_has_no_edge_to_come() -> None:
    trigger = sound_input()
    assert trigger.next_tick is None
    assert edges(trigger, range(10)) == []


@given(rate_hz=st.floats(0.5, 1000.0), start=st.integers(0, 10**7))
def test_a_train_keeps_its_rate_without_drift(rate_hz: float, start: int) -> None:
    """Edge n comes n periods after the start, not a rounded period after the one before."""
    trigger = sound_input()
    trigger.start_train(rate_hz, start)
    found = edges(trigger, range(start, start + 3000))
    expected = [start + float(n * TICK_HZ / Fraction(rate_hz)) for n in range(1, len(found) + 1)]
    assert len(found) in {int(3 * rate_hz) - 1, int(3 * rate_hz), int(3 * rate_hz) + 1}
    assert found == pytest.approx(expected, abs=1e-6)


def test_single_edges_come_in_the_order_of_their_instants_among_the_train() -> None:
    trigger = sound_input()
    trigger.start_train(400.0, 0)  # at 2.5, 5, 7.5 ...
    trigger.add_edge(6, 0.75)
    trigger.add_edge(2, 0.25)
    trigger.add_edge(2, 0.125)
    assert trigger.next_tick == 2
    assert edges(trigger, range(8)) == [2.125, 2.25, 2.5, 5.0, 6.75, 7.5]
    assert trigger.next_tick == 10


def test_two_edges_at_one_instant_are_two() -> None:
    trigger = sound_input()
    trigger.start_train(500.0, 0)
    trigger.add_edge(2, 0.0)
    assert edges(trigger, range(3)) == [2.0, 2.0]


def test_a_rate_of_zero_ends_the_train_and_leaves_single_edges() -> None:
    trigger = sound_input()
    trigger.start_train(100.0, 0)
    trigger.add_edge(3, 0.5)
    trigger.start_train(0.0, 0)
    assert edges(trigger, range(100)) == [3.5]


@pytest.mark.parametrize("rate_hz", [-1.0, 1000.1, float("inf"), float("nan")])
def test_a_rate_beyond_one_edge_a_tick_is_refused(rate_hz: float) -> None:
    trigger = sound_input()
    with pytest.raises(ValueError, match=r"outside 0\.\.1000 Hz"):
        trigger.start_train(rate_hz, 0)


def test_an_edge_that_never_comes_is_no_error() -> None:
    trigger = sound_input()
    trigger.start_train(5e-324, 0)
    assert edges(trigger, range(3)) == []
