"""Signals as a descriptor for select, so that they are handled between other events and never during one."""

import signal
import socket
from types import FrameType, TracebackType
from typing import Self


class SignalWatch:
    """Collects signals while it is entered. The earlier handlers are restored afterwards.

    Args:
        names: such as `SIGTERM`. Names that the system does not have are ignored. An ignored `SIGHUP` stays ignored: a
            program started with nohup must outlive its terminal.
    """

    def __init__(self, *names: str) -> None:
        self._numbers = [getattr(signal, name) for name in names if hasattr(signal, name) and not _is_nohup(name)]
        self._reader, self._writer = socket.socketpair()
        self._reader.setblocking(False)
        self._writer.setblocking(False)

    @property
    def descriptor(self) -> int:
        """A descriptor that becomes readable when a signal has been received."""
        return self._reader.fileno()

    def received(self) -> list[signal.Signals]:
        """Return the signals since the last call, in their order."""
        try:
            return [signal.Signals(number) for number in self._reader.recv(4096)]
        except BlockingIOError:
            return []

    def __enter__(self) -> Self:
        self._before = {number: signal.signal(number, _collected) for number in self._numbers}
        self._descriptor_before = signal.set_wakeup_fd(self._writer.fileno(), warn_on_full_buffer=False)
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        signal.set_wakeup_fd(self._descriptor_before)
        for number, handler in self._before.items():
            signal.signal(number, handler)
        self._reader.close()
        self._writer.close()


def _is_nohup(name: str) -> bool:
    return name == "SIGHUP" and signal.getsignal(signal.SIGHUP) is signal.SIG_IGN


def _collected(number: int, frame: FrameType | None) -> None:
    """Do nothing: with a handler, the interpreter writes the signal's number to the wake-up descriptor."""
