"""Tests are repeatable: hypothesis draws the same examples in each run.

To look for new ones: `python -m pytest --hypothesis-profile=explore`.
"""

import signal
from collections.abc import Callable, Iterator
from types import FrameType

import pytest
from hypothesis import settings

settings.register_profile("repeatable", derandomize=True, deadline=None)
settings.register_profile("explore", deadline=None, max_examples=1000)
settings.load_profile("repeatable")


_HANDLERS: dict[signal.Signals, Callable[[int, FrameType | None], object] | signal.Handlers] = {
    signal.SIGINT: signal.default_int_handler,
    signal.SIGTERM: signal.SIG_DFL,
    signal.SIGHUP: signal.SIG_DFL,
}


@pytest.fixture(scope="session", autouse=True)
def _signals_are_received() -> Iterator[None]:
    """Let tests send signals to themselves and to programs that they start, even if `&` or nohup has ignored them."""
    ignored = [number for number in _HANDLERS if signal.getsignal(number) is signal.SIG_IGN]
    for number in ignored:
        signal.signal(number, _HANDLERS[number])
    yield
    for number in ignored:
        signal.signal(number, signal.SIG_IGN)
