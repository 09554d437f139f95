"""A symbolic link that gives the pty a name that stays the same from run to run."""

import errno
import os
from contextlib import suppress
from pathlib import Path

_PTY_PREFIXES = ("/dev/pts/", "/dev/ttys", "/dev/ttyp")
"""What the names of pseudo-terminals begin with: Linux, macOS, older BSDs."""


class DeviceLink:
    """A link to a pty, put there atomically and taken away by `remove`.

    Raises:
        FileExistsError: something else than a link to a pty is at the path.
        OSError: the path cannot be written.
    """

    def __init__(self, path: Path, device: str) -> None:
        self.path = path
        self._device = device
        self.replaced = _target(path)
        """The pty that an older link at this path led to, or None."""
        if self.replaced is None:
            path.symlink_to(device)
        else:
            _replace(path, device)

    def lead_to(self, device: str) -> None:
        """Lead to another device from now on.

        Raises:
            FileExistsError: something else than a link to a pty has taken the link's place.
            OSError: the path cannot be written.
        """
        _target(self.path)
        _replace(self.path, device)
        self._device = device

    def remove(self) -> None:
        """Take the link away, unless somebody else has put another one there since."""
        with suppress(OSError):
            if str(self.path.readlink()) == self._device:
                self.path.unlink()


def _target(path: Path) -> str | None:
    """Return the pty that the link leads to, or None when nothing is there."""
    if not os.path.lexists(path):
        return None
    target = str(path.readlink()) if path.is_symlink() else ""
    if not target.startswith(_PTY_PREFIXES):
        raise FileExistsError(errno.EEXIST, "something else than a link to a pty is there")
    return target


def _replace(path: Path, device: str) -> None:
    temporary = path.with_name(f"{path.name}.{os.getpid()}")
    temporary.symlink_to(device)
    temporary.replace(path)
