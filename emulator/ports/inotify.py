"""Report who opens, writes and closes a device that this process itself holds open (Linux inotify)."""

import ctypes
import os
import struct
from collections.abc import Iterator
from pathlib import Path

WRITTEN = 0x02
OPENED = 0x20
CLOSED = 0x18
"""Closed by a writer (0x08) or by a reader (0x10)."""

_HEADER = struct.Struct("iIII")
_READ_BYTES = 65536


class DeviceWatch:
    """A stream of the actions of other programs on one device, in their order.

    The kernel merges equal consecutive events, so two openings would count as one. It reports an opening to the watch
    of the directory and to the watch of the device in turn. With both watches, no two consecutive events are equal.
    """

    def __init__(self, descriptor: int, device_watch: int) -> None:
        self.descriptor = descriptor
        self._device_watch = device_watch

    @classmethod
    def start(cls, device: Path) -> "DeviceWatch | None":
        """Return a watch on the device, or None if the system does not support it."""
        libc = ctypes.CDLL(None)
        if not hasattr(libc, "inotify_init1"):
            return None
        descriptor = libc.inotify_init1(os.O_NONBLOCK | os.O_CLOEXEC)
        if descriptor < 0:
            return None
        directory_watch = libc.inotify_add_watch(descriptor, os.fsencode(device.parent), OPENED | CLOSED)
        device_watch = libc.inotify_add_watch(descriptor, os.fsencode(device), OPENED | CLOSED | WRITTEN)
        if min(directory_watch, device_watch) < 0:
            os.close(descriptor)
            return None
        return cls(descriptor, device_watch)

    def events(self) -> Iterator[int]:
        """Yield `OPENED`, `WRITTEN` and `CLOSED` in the order of the events since the last call."""
        while data := self._read():
            position = 0
            while position < len(data):
                watch, mask, _, name_length = _HEADER.unpack_from(data, position)
                position += _HEADER.size + name_length
                if watch == self._device_watch:
                    yield CLOSED if mask & CLOSED else mask & (OPENED | WRITTEN)

    def close(self) -> None:
        """Stop watching."""
        os.close(self.descriptor)

    def _read(self) -> bytes:
        try:
            return os.read(self.descriptor, _READ_BYTES)
        except BlockingIOError:
            return b""
