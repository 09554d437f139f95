"""The watch over the testing machine, compared with a process that is stopped for a known time."""

import signal
import subprocess
import sys
import time
from contextlib import AbstractContextManager

import pytest

from protocol.conformance.bench.host_watch import HostWatch, Punctual, watch_in

STOPPED_S = 0.4
WATCHED = """
import sys, time
from protocol.conformance.bench.host_watch import HostWatch

with HostWatch() as watch:
    print("watching", flush=True)
    sys.stdin.readline()
    print(watch.late_s(), flush=True)
    watch.wait_for_calm(allowed_s=0.2, patience_s=20.0)
    print(watch.late_s(), flush=True)
"""


@pytest.mark.realtime
def test_a_machine_that_stands_still_is_late_by_as_much_and_calm_after_it() -> None:
    command = [sys.executable, "-c", WATCHED]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdin is not None
        assert process.stdout is not None
        assert process.stdout.readline() == "watching\n"
        process.send_signal(signal.SIGSTOP)
        time.sleep(STOPPED_S)
        process.send_signal(signal.SIGCONT)
        process.stdin.write("\n")
        process.stdin.flush()
        late_s, calm_s = float(process.stdout.readline()), float(process.stdout.readline())

    assert late_s >= 0.9 * STOPPED_S
    assert calm_s < late_s


@pytest.mark.realtime
def test_patience_ends_on_a_machine_that_is_never_calm() -> None:
    with HostWatch() as watch:
        begin_s = time.monotonic()
        watch.wait_for_calm(allowed_s=-1.0, patience_s=0.3)

        assert time.monotonic() - begin_s >= 0.3


def test_simulated_time_is_never_late() -> None:
    watching: AbstractContextManager[object] = watch_in(simulated=True)

    with watching as watch:
        assert isinstance(watch, Punctual)
        assert watch.late_s() == 0.0
