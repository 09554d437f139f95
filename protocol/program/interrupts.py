"""Signals that end a program: how they are handled, when they are deferred, and the exit status.

SIGINT (Ctrl-C), SIGTERM and SIGHUP raise a `KeyboardInterrupt` in the main thread, so that each of them stops a moving
table. A signal that was ignored at the start of the program (`nohup`, `&` in a script) stays ignored.
"""

import signal
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType

from protocol.program.quiet_start import IS_PROGRAM, end_quietly

_NAMES = ("SIGINT", "SIGTERM", "SIGHUP")
_Handler = Callable[[int, FrameType | None], object] | int | None


class Interrupted(KeyboardInterrupt):
    """A signal requested the end of the program. The argument is the number of the signal."""


class Ending:
    """The signals received within a block of `ended_by_signals`.

    Attributes:
        number: number of the first signal; None if no signal was received.
    """

    def __init__(self) -> None:
        self.number: int | None = None
        self.is_handled = True

    def take(self, number: int, _: FrameType | None) -> None:
        """Interrupt the program once: a second signal must not interrupt the handling of the first one."""
        if self.number is None:
            self.number = number
        if self.is_handled:
            self.is_handled = False
            raise Interrupted(number)

    def status(self, otherwise: int) -> int:
        """Return 128 plus the number of the signal that ended the program, else the program's own exit status."""
        return otherwise if self.number is None else 128 + self.number


_endings: list[Ending] = []


@contextmanager
def ended_by_signals() -> Iterator[Ending]:
    """Turn each of the signals into a KeyboardInterrupt within the block. Nested blocks share their signals.

    After the first signal, others are dropped until a block of `signals_wait` has ended: the table has been stopped
    then. A signal that is ignored, or has a handler of the caller, keeps that handler. At the end all handlers are
    restored. If a signal has ended the program, the signals are ignored, so that none changes the exit status during
    shutdown.
    """
    if _endings:
        yield _endings[-1]
        return
    ending = Ending()
    before: dict[int, _Handler] = {}
    if _is_main_thread():
        for number in _numbers():
            former = signal.getsignal(number)
            if former in {signal.SIG_DFL, signal.default_int_handler, end_quietly}:
                before[number] = signal.signal(number, ending.take)
    _endings.append(ending)
    try:
        yield ending
    finally:
        _endings.remove(ending)
        is_over = IS_PROGRAM and ending.number is not None
        _put_back(dict.fromkeys(before, signal.SIG_IGN) if is_over else before)


@contextmanager
def signals_wait() -> Iterator[None]:
    """Defer the signals until the block ends. While an interrupt is being handled, they are dropped."""
    if not _is_main_thread():
        yield  # signals are not handled here
        return
    is_ending = isinstance(sys.exception(), KeyboardInterrupt)
    kept: list[int] = []
    before = {
        number: signal.signal(number, lambda number, _: kept.append(number))
        for number in _numbers()
        if signal.getsignal(number) not in (signal.SIG_IGN, None)
    }
    try:
        yield
    finally:
        _put_back(before)
        if is_ending:
            for ending in _endings:
                ending.is_handled = True
        elif kept:
            signal.raise_signal(kept[0])


def said(error: BaseException, message: str = "") -> str:
    """Return the message of an error, or a replacement for it, and its notes, in one line."""
    return "; ".join([message or str(error), *getattr(error, "__notes__", ())])


def status_after(interrupt: KeyboardInterrupt) -> int:
    """Return the exit status of a program that a signal has ended: 128 plus the signal's number."""
    number = interrupt.args[0] if isinstance(interrupt, Interrupted) else signal.SIGINT
    return 128 + int(number)


def _numbers() -> list[int]:
    return [int(getattr(signal, name)) for name in _NAMES if hasattr(signal, name)]  # not every system has them


def _put_back(handlers: dict[int, _Handler]) -> None:
    for number, handler in handlers.items():
        signal.signal(number, handler)


def _is_main_thread() -> bool:
    return threading.current_thread() is threading.main_thread()
