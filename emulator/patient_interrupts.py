"""Ctrl-C during a compiled run: it waits until that is over.

Numba compiles with callbacks from machine code into Python, and turns a run's result into named tuples without asking
whether that failed. An interrupt that is raised there is lost, or crashes the process.
"""

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager


@contextmanager
def interrupts_wait() -> Iterator[None]:
    """Keep an interrupt of the main thread until the block is done."""
    if threading.current_thread() is not threading.main_thread():
        yield  # no signal is handled here
        return
    kept: list[int] = []
    former = signal.signal(signal.SIGINT, lambda number, _: kept.append(number))
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, former)
        if kept:
            signal.raise_signal(signal.SIGINT)
