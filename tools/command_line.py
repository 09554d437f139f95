"""What the command lines of the tools check before they work."""

import os
from pathlib import Path


def check_writable(path: Path) -> None:
    """Refuse a file that could not be written, before the work for it is done.

    Raises:
        OSError: Its folder is not there, is none, or may not be written to, or the path is a folder.
    """
    folder = path.parent
    if not folder.is_dir():
        raise NotADirectoryError(f"{folder} is not a folder")
    if not os.access(folder, os.W_OK):
        raise PermissionError(f"{folder} may not be written to")
    if path.is_dir():
        raise IsADirectoryError(f"{path} is a folder")


def check_folder(folder: Path) -> None:
    """Refuse a folder that could not be made or written to, before the work for it is done.

    Raises:
        OSError: It, or what it would be made in, is no folder or may not be written to.
    """
    nearest = next(parent for parent in (folder, *folder.absolute().parents) if parent.exists())
    if not nearest.is_dir():
        raise NotADirectoryError(f"{nearest} is not a folder")
    if not os.access(nearest, os.W_OK):
        raise PermissionError(f"{nearest} may not be written to")
