import signal
import threading
from contextlib import suppress

import pytest

from protocol.program import interrupts
from protocol.program.interrupts import ended_by_signals, said, signals_wait, status_after
from protocol.program.quiet_start import program_run


def test_an_interrupt_waits_until_the_block_is_done() -> None:
    reached = []

    def interrupted() -> None:
        with signals_wait():
            signal.raise_signal(signal.SIGINT)
            reached.append("end of the block")
        reached.append("beyond")

    with pytest.raises(KeyboardInterrupt):
        interrupted()
    assert reached == ["end of the block"]


def test_interrupts_are_as_before_afterwards() -> None:
    former = signal.getsignal(signal.SIGINT)
    with signals_wait():
        assert signal.getsignal(signal.SIGINT) != former
    assert signal.getsignal(signal.SIGINT) == former


def test_another_thread_keeps_its_hands_off_signals() -> None:
    seen = []

    def work() -> None:
        with signals_wait():
            seen.append(signal.getsignal(signal.SIGINT))

    former = signal.getsignal(signal.SIGINT)
    thread = threading.Thread(target=work)
    thread.start()
    thread.join()
    assert seen == [former]


def test_each_signal_breaks_in_and_gives_its_status() -> None:
    for number, status in ((signal.SIGINT, 130), (signal.SIGTERM, 143), (signal.SIGHUP, 129)):
        former = signal.getsignal(number)
        with ended_by_signals() as ending:
            with pytest.raises(KeyboardInterrupt) as interrupt:
                signal.raise_signal(number)
            assert ending.status(0) == status_after(interrupt.value) == status
        assert signal.getsignal(number) == former


def test_a_second_signal_waits_until_what_the_first_began_is_over() -> None:
    done = []
    with ended_by_signals() as ending:
        try:
            signal.raise_signal(signal.SIGHUP)
        except KeyboardInterrupt:
            signal.raise_signal(signal.SIGTERM)  # before the table is being stopped
            with signals_wait():
                signal.raise_signal(signal.SIGINT)
                done.append("stopped")
        with pytest.raises(KeyboardInterrupt):
            signal.raise_signal(signal.SIGINT)  # what comes then can be interrupted again
        assert ending.status(2) == 129
    assert done == ["stopped"]


def test_a_block_within_another_shares_its_signals() -> None:
    with ended_by_signals() as outer:
        with ended_by_signals() as inner, pytest.raises(KeyboardInterrupt):
            signal.raise_signal(signal.SIGTERM)
        assert inner.status(0) == outer.status(0) == 143


def test_a_program_that_a_signal_has_ended_is_unloaded_in_peace(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(interrupts, "IS_PROGRAM", True)
    formers = {number: signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)}
    try:
        with ended_by_signals():
            pass
        assert {number: signal.getsignal(number) for number in formers} == formers
        with ended_by_signals() as ending, suppress(KeyboardInterrupt):
            signal.raise_signal(signal.SIGTERM)
        signal.raise_signal(signal.SIGINT)
        signal.raise_signal(signal.SIGTERM)
        assert ending.status(0) == 143
    finally:
        for number, former in formers.items():
            signal.signal(number, former)


@pytest.mark.parametrize("handler", [signal.SIG_IGN, lambda _number, _frame: None])
def test_ignored_signals_and_handlers_of_the_callers_own_are_left_alone(handler: signal.Handlers) -> None:
    former = signal.signal(signal.SIGTERM, handler)
    try:
        with ended_by_signals() as ending:
            assert signal.getsignal(signal.SIGTERM) is handler
            signal.raise_signal(signal.SIGTERM)
            assert ending.number is None
    finally:
        signal.signal(signal.SIGTERM, former)


def test_the_notes_of_an_error_are_told_with_it() -> None:
    error = ValueError("it failed")
    error.add_note("the table stands at 3 deg")
    assert said(error) == "it failed; the table stands at 3 deg"
    assert said(error, "interrupted") == "interrupted; the table stands at 3 deg"


@pytest.mark.parametrize(
    ("command", "module"),
    [
        (["python", "-m", "planner", "run"], "planner"),
        (["python", "-X", "importtime", "-W", "error", "-m", "tools.tune", "-m", "x"], "tools.tune"),
        (["python", "-u", "-m", "pytest"], "pytest"),
        (["python", "-c", "pass", "-m", "planner"], ""),
        (["python", "script.py", "-m", "planner"], ""),
        (["python"], ""),
        (["python", "/home/me/bin/seventh-axis", "plan"], "seventh-axis"),
        (["python.exe", r"C:\bin\seventh-axis.exe", "plan"], "seventh-axis"),
        (["python", "emulator.py"], ""),
        (["python", "tools"], ""),
    ],
)
def test_only_a_program_of_this_project_is_ended_quietly(command: list[str], module: str) -> None:
    assert program_run(command) == module
