"""A symbolic link that gives the pty the same name in each run."""

import errno
import os
from contextlib import suppress
from pathlib import Path

_PTY_PREFIXES = ("/dev/pts/", "/dev/ttys", "/dev/ttyp")
"""How the names of pseudo-terminals start: Linux, macOS, older BSDs."""


class DeviceLink:
    """A link to a pty, created atomically and removed by `remove`.

    Raises:
        FileExistsError: the path is not a link to a pty, or it is a link to a pty that still exists.
        OSError: the path cannot be written.
    """

    def __init__(self, path: Path, device: str) -> None:
        self.path = path
        self._device = device
        self.replaced = _target(path, device)
        """The target of an older link at this path, or None."""
        if self.replaced is None:
            path.symlink_to(device)
        else:
            _replace(path, device)

    def lead_to(self, device: str) -> None:
        """Point to another device from now on.

        Raises:
            FileExistsError: the link was replaced by another file, or by another emulator's link.
            OSError: the path cannot be written.
        """
        _target(self.path, device)
        _replace(self.path, device)
        self._device = device

    def remove(self) -> None:
        """Remove the link, unless another program has replaced it."""
        with suppress(OSError):
            if str(self.path.readlink()) == self._device:
                self.path.unlink()


def _target(path: Path, device: str) -> str | None:
    """Return the pty that the link points to, or None if there is none.

    A pty exists as long as the program that created it. A link to one, except `device`, belongs to another emulator.
    """
    if not os.path.lexists(path):
        return None
    target = str(path.readlink()) if path.is_symlink() else ""
    if not target.startswith(_PTY_PREFIXES):
        raise FileExistsError(errno.EEXIST, "the path exists and is not a link to a pty")
    if target != device and Path(target).exists():
        raise FileExistsError(errno.EEXIST, f"it points to {target}, which another emulator serves")
    return target


def _replace(path: Path, device: str) -> None:
    temporary = path.with_name(f"{path.name}.{os.getpid()}")
    temporary.symlink_to(device)
    temporary.replace(path)
