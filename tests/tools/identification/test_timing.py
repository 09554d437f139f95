import numpy as np
import pytest

from emulator.config.table_config import TableConfig
from tools.emulated import Array
from tools.identification.recording import WireRecording
from tools.identification.timing import Timing, timing


@pytest.fixture(name="exact", scope="module")
def exact_timing(assumed: TableConfig, recording: WireRecording) -> Timing:
    return timing(assumed, recording)


def assert_same_but_for_the_origin(told: Timing, readings: Array, commands: Array) -> None:
    """Compare ticks; a common shift of all of them does not matter, because only differences count."""
    shift = told.readings[0] - readings[0]
    np.testing.assert_array_equal(told.readings, readings + shift)
    np.testing.assert_array_equal(told.commands, commands + shift)
    assert abs(shift) <= 1.0


def test_in_virtual_time_every_line_is_carried_out_as_soon_as_it_is_complete(
    exact: Timing, recording: WireRecording
) -> None:
    commands_s = np.array([sent.time_s for sent in recording.commands])

    assert_same_but_for_the_origin(
        exact, np.ceil(1000.0 * recording.time_s - 1e-3), np.ceil(1000.0 * commands_s - 1e-3)
    )
    assert not exact.doubtful_readings.any()
    assert not exact.doubtful_commands.any()


def test_replies_that_come_a_little_late_tell_the_tick(
    exact: Timing, recording: WireRecording, assumed: TableConfig
) -> None:
    chance = np.random.default_rng(3)
    late_s = 0.2e-3 + chance.uniform(0.0, 0.3e-3, len(recording.time_s))
    early_s = chance.uniform(0.0, 0.9e-3, len(recording.time_s))

    told = timing(
        assumed,
        recording._replace(
            time_s=recording.time_s - early_s,
            reply_s=recording.reply_s + late_s,
            commands=tuple(sent._replace(reply_s=sent.reply_s + 0.3e-3) for sent in recording.commands),
        ),
    )

    assert_same_but_for_the_origin(told, exact.readings, exact.commands)


def test_a_recorder_whose_clock_runs_faster_than_the_tables_finds_the_same_ticks(
    exact: Timing, recording: WireRecording, assumed: TableConfig
) -> None:
    faster = 1.0 + 47e-6

    told = timing(
        assumed,
        recording._replace(
            time_s=recording.time_s * faster,
            reply_s=recording.reply_s * faster,
            commands=tuple(
                sent._replace(time_s=sent.time_s * faster, reply_s=sent.reply_s * faster) for sent in recording.commands
            ),
        ),
    )

    assert_same_but_for_the_origin(told, exact.readings, exact.commands)


def test_what_came_much_later_than_the_rest_is_in_doubt(recording: WireRecording, assumed: TableConfig) -> None:
    late_s = np.zeros(len(recording.time_s))
    late_s[::10] = 5e-3

    told = timing(assumed, recording._replace(reply_s=recording.reply_s + late_s))

    np.testing.assert_array_equal(told.doubtful_readings, late_s > 0.0)


def test_without_the_times_of_replies_the_commands_times_are_taken_at_their_word(
    exact: Timing, recording: WireRecording, assumed: TableConfig
) -> None:
    told = timing(
        assumed,
        recording._replace(
            reply_s=np.full(len(recording.time_s), np.nan),
            commands=tuple(sent._replace(reply_s=np.nan) for sent in recording.commands),
        ),
    )

    assert_same_but_for_the_origin(told, exact.readings, exact.commands)
    assert not told.doubtful_readings.any()
