import pytest

from emulator.config.table_config import load_config
from emulator.firmware.controller import IDLE, begin_motion
from emulator.firmware.profiler import Profile
from emulator.plant.drive_train import at_standstill
from emulator.table.tick import TableConstants, TableState, run_undisturbed, step, table_constants, woken

COUNT = 1 << 26


def table_at_rest() -> tuple[TableConstants, TableState]:
    constants = table_constants(load_config(), encoder_phase=0.25)
    return constants, woken(constants, at_standstill(constants.drive, gap_share=0.5), Profile.of(1, 1))


def table_in_motion() -> tuple[TableConstants, TableState]:
    """Return a table that is commanded to turn by 100 counts, at 10 deg/s and 20 deg/s2."""
    constants, state = table_at_rest()
    profile = Profile.of(round(5.12 * COUNT), round(0.01024 * COUNT))
    bits = constants.firmware.motion_bits
    return constants, state._replace(firmware=begin_motion(state.firmware, profile, 100 * COUNT, bits))


def test_a_table_wakes_at_rest_where_it_stands() -> None:
    constants, state = table_at_rest()
    assert step(constants, state, 0.0) == state


@pytest.mark.parametrize("ticks", [0, 1, 250])
def test_undisturbed_ticks_are_steps_one_after_the_other(ticks: int) -> None:
    constants, state = table_in_motion()
    expected = state
    for _ in range(ticks):
        expected = step(constants, expected, 0.2)
    assert run_undisturbed(constants, state, 0.2, ticks) == (expected, False)


def test_a_table_that_rests_is_told_from_one_that_will_move_on() -> None:
    """A year of rest takes no time; a table at its target is not at rest while its motor still decelerates."""
    constants, state = table_in_motion()
    at_rest, rests = run_undisturbed(constants, state, 0.0, 365 * 86_400_000)
    assert rests
    assert at_rest.firmware.motion == IDLE
    assert step(constants, at_rest, 0.0) == at_rest
