import signal
import subprocess
import sys
import threading

import pytest

from tools.patient_interrupts import interrupts_wait


def test_an_interrupt_waits_until_the_block_is_done() -> None:
    reached = []

    def interrupted() -> None:
        with interrupts_wait():
            signal.raise_signal(signal.SIGINT)
            reached.append("end of the block")
        reached.append("beyond")

    with pytest.raises(KeyboardInterrupt):
        interrupted()
    assert reached == ["end of the block"]


def test_interrupts_are_as_before_afterwards() -> None:
    former = signal.getsignal(signal.SIGINT)
    with interrupts_wait():
        assert signal.getsignal(signal.SIGINT) != former
    assert signal.getsignal(signal.SIGINT) == former


def test_another_thread_keeps_its_hands_off_signals() -> None:
    seen = []

    def work() -> None:
        with interrupts_wait():
            seen.append(signal.getsignal(signal.SIGINT))

    former = signal.getsignal(signal.SIGINT)
    thread = threading.Thread(target=work)
    thread.start()
    thread.join()
    assert seen == [former]


INTERRUPTED_RUN = """
import os, signal, sys, threading
from emulator.config import load_config
from tools.command_line import ended
from tools.emulated import Motion, emulate

config = load_config()
motions = [Motion(0.1, 1000.0, 10.0, 100.0)]
emulate(config, motions, 0.2)  # compiled now

def work():
    threading.Timer(0.1, os.kill, (os.getpid(), signal.SIGINT)).start()
    for _ in range(600):
        emulate(config, motions, 200.0)
    return 0

sys.exit(ended("tool", work))
"""


@pytest.mark.skipif(sys.platform == "win32", reason="there a process cannot interrupt itself so")
def test_an_interrupt_in_a_compiled_run_ends_the_command_and_does_not_crash_it() -> None:
    done = subprocess.run(
        [sys.executable, "-c", INTERRUPTED_RUN], check=False, capture_output=True, text=True, timeout=120.0
    )

    assert (done.returncode, done.stderr) == (130, "tool: interrupted\n")
