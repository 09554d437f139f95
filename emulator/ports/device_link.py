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
        FileExistsError: something else than a link to a pty is at the path, or the pty that it leads to is there.
        OSError: the path cannot be written.
    """

    def __init__(self, path: Path, device: str) -> None:
        self.path = path
        self._device = device
        self.replaced = _target(path, device)
        """The pty that an older link at this path led to, or None."""
        if self.replaced is None:
            path.symlink_to(device)
        else:
            _replace(path, device)

    def lead_to(self, device: str) -> None:
        """Lead to another device from now on.

        Raises:
            FileExistsError: something else than a link to a pty has taken the link's place, or another's link.
            OSError: the path cannot be written.
        """
        _target(self.path, device)
        _replace(self.path, device)
        self._device = device

    def remove(self) -> None:
        """Take the link away, unless somebody else has put another one there since."""
        with suppress(OSError):
            if str(self.path.readlink()) == self._device:
                self.path.unlink()


def _target(path: Path, device: str) -> str | None:
    """Return the pty that the link leads to, or None when nothing is there.

    A pty is there as long as the program that made it: a link to one, `device` excepted, is another emulator's.
    """
    if not os.path.lexists(path):
        return None
    target = str(path.readlink()) if path.is_symlink() else ""
    if not target.startswith(_PTY_PREFIXES):
        raise FileExistsError(errno.EEXIST, "something else than a link to a pty is there")
    if target != device and Path(target).exists():
        raise FileExistsError(errno.EEXIST, f"it leads to {target}, which another emulator serves")
    return target


def _replace(path: Path, device: str) -> None:
    temporary = path.with_name(f"{path.name}.{os.getpid()}")
    temporary.symlink_to(device)
    temporary.replace(path)
