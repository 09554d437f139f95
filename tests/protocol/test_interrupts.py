import signal
import threading

import pytest

from protocol.interrupts import signals_wait


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
