"""The corrections of a stream, without a table: the reference follows the controller's rules."""

import pytest

from planner.execution.stream import TimedCommand, reference_states, stream
from planner.execution.stream_correction import CorrectedStream
from planner.execution.table_motion import TableMotion
from planner.table.motion import Limits
from planner.table.wire import StreamError, Wire
from tests.planner.run_examples import paused_run_input, short_run_input

LIMITS, WIRE = Limits(), Wire()
MOTION = TableMotion(short_run_input().plan, LIMITS)
DELAY_S = 0.0035


def corrected(drift_deg: float = 0.15, motion: TableMotion = MOTION) -> CorrectedStream:
    return CorrectedStream(
        motion, LIMITS, WIRE, drift_deg, drift_filter_s=1.0, encoder_delay_s=DELAY_S, run_on_deg=90.0
    )


def run(commands: CorrectedStream, late_s: dict[int, float], ahead_deg: float = 0.0) -> list[TimedCommand]:
    """Send all commands, some late, to a table that is always ahead, and return them with their effect."""
    effects: list[TimedCommand] = []
    while (timed := commands.next()) is not None:
        commands.sent(timed, late_s.get(len(effects), 0.0))
        assert commands.running is not None
        effects.append(commands.running)
        for time_s in (timed.time_s + 0.03, timed.time_s + 0.08):
            (there,) = reference_states([commands.running], [time_s - DELAY_S])
            commands.encoder_read(time_s, there.angle_deg + ahead_deg)
    return effects


def test_when_nothing_goes_wrong_the_stream_stays_as_it_is() -> None:
    commands = corrected()
    planned = [(each.time_s, each.command) for each in stream(MOTION, LIMITS, WIRE)]
    assert [(each.time_s, each.command) for each in run(commands, {})] == planned
    assert commands.corrections == []


def test_what_a_late_command_costs_is_taken_out_by_the_next_ones() -> None:
    commands = corrected()
    effects = run(commands, {5: 0.03})
    assert [each.time_s for each in commands.corrections] == [effects[6].leg.start_s]
    assert 0.03 < abs(commands.corrections[0].slip_deg) < 1.0
    off_deg = [
        state.angle_deg - MOTION.state_at(time_s).angle_deg
        for time_s, state in zip(MOTION.column_times_s, reference_states(effects, MOTION.column_times_s), strict=True)
    ]
    assert abs(off_deg[6]) > 0.03
    assert max(map(abs, off_deg[8:])) < 0.02


def test_what_is_streamed_anew_keeps_the_run_on_short() -> None:
    commands = corrected()
    effects = run(commands, {3: 0.05, 9: 0.05})
    assert len(commands.corrections) >= 2
    for effect in effects:
        assert abs(effect.command.target_deg - effect.expected.angle_deg) <= 90.0


def test_a_table_that_drifts_is_streamed_anew_from_where_it_is() -> None:
    commands = corrected()
    run(commands, {}, ahead_deg=0.4)
    first = commands.corrections[0]
    assert 0.15 < first.slip_deg <= 0.4
    assert MOTION.start_s < first.time_s < MOTION.end_s


def test_less_than_the_drift_allowed_is_left_alone() -> None:
    commands = corrected(drift_deg=0.5)
    run(commands, {}, ahead_deg=0.4)
    assert commands.corrections == []


def test_a_reading_from_before_the_command_took_effect_says_nothing() -> None:
    commands = corrected(drift_deg=0.001)
    for _ in range(2):
        timed = commands.next()
        assert timed is not None
        commands.sent(timed, 0.0)
        for early_s in (0.002, 0.001, 0.0):
            commands.encoder_read(timed.time_s + DELAY_S - 0.0005 - early_s, 90.0)
    commands.next()
    assert commands.corrections == []


def test_a_command_may_be_late_by_a_share_of_the_step_before() -> None:
    commands = corrected(motion=TableMotion(paused_run_input().plan, LIMITS))
    allowed_s = []
    while (timed := commands.next()) is not None:
        allowed_s.append(commands.latest_s(timed))
        commands.sent(timed, 0.0)
    assert min(allowed_s) > 0.0
    assert max(allowed_s) > min(allowed_s)


def test_commands_that_do_not_fit_the_line_are_refused() -> None:
    with pytest.raises(StreamError, match="use a time step of at least"):
        CorrectedStream(MOTION, LIMITS, Wire(baud=1200), 0.15, 3.0, 0.0, 90.0)
