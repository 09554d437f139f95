"""Signals that end a program: how it learns of them, with which status it ends, and when they have to wait.

SIGINT (Ctrl-C), SIGTERM and SIGHUP all break into the main thread as a `KeyboardInterrupt`, so that a table in motion
is stopped whichever came. A signal that was ignored when the program began (`nohup`, `&` in a script) stays ignored.
"""

import signal
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType

from protocol.quiet_start import IS_PROGRAM, end_quietly

_NAMES = ("SIGINT", "SIGTERM", "SIGHUP")
_Handler = Callable[[int, FrameType | None], object] | int | None


class Interrupted(KeyboardInterrupt):
    """A signal told the program to end; its argument is the number of the signal."""


class Ending:
    """The signals that have come while `ended_by_signals` holds.

    Attributes:
        number: of the first signal; None while none has come.
    """

    def __init__(self) -> None:
        self.number: int | None = None
        self.is_handled = True

    def take(self, number: int, _: FrameType | None) -> None:
        """Break into the program, once: what the first signal began is not to be cut short by a second one."""
        if self.number is None:
            self.number = number
        if self.is_handled:
            self.is_handled = False
            raise Interrupted(number)

    def status(self, otherwise: int) -> int:
        """Return the exit status of a program: 128 and the number of the signal that ended it, else its own."""
        return otherwise if self.number is None else 128 + self.number


_endings: list[Ending] = []


@contextmanager
def ended_by_signals() -> Iterator[Ending]:
    """Let each of the signals break into the block as a KeyboardInterrupt; a block within another shares its signals.

    After the first, signals are dropped until a block of `signals_wait` has ended: a table that is being stopped then
    stands. A signal that is ignored, or has a handler of the caller's own, keeps that. At the end all are put back; in
    a program that a signal has ended, they are ignored, so that none changes its exit status while it is unloaded.
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
    """Keep the signals until the block is done. While an interrupt is being handled, they are dropped."""
    if not _is_main_thread():
        yield  # no signal is handled here
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
    """Return an error's message, or another in its place, and its notes, in one line."""
    return "; ".join([message or str(error), *getattr(error, "__notes__", ())])


def status_after(interrupt: KeyboardInterrupt) -> int:
    """Return the exit status of a program that a signal has ended: 128 and its number."""
    number = interrupt.args[0] if isinstance(interrupt, Interrupted) else signal.SIGINT
    return 128 + int(number)


def _numbers() -> list[int]:
    return [int(getattr(signal, name)) for name in _NAMES if hasattr(signal, name)]  # not every system has them


def _put_back(handlers: dict[int, _Handler]) -> None:
    for number, handler in handlers.items():
        signal.signal(number, handler)


def _is_main_thread() -> bool:
    return threading.current_thread() is threading.main_thread()
