"""The common end of the tools' command lines."""

import os
from pathlib import Path


def check_writable(path: Path) -> None:
    """Refuse a file that cannot be written, before the work for it is done.

    Raises:
        OSError: its folder does not exist, is not a folder, or is not writable, or the path is a folder.
    """
    folder = path.parent
    if not folder.is_dir():
        raise NotADirectoryError(f"{folder} is not a folder")
    if not os.access(folder, os.W_OK):
        raise PermissionError(f"{folder} is not writable")
    if path.is_dir():
        raise IsADirectoryError(f"{path} is a folder")


def check_folder(folder: Path) -> None:
    """Refuse a folder that cannot be created or written to, before the work for it is done.

    Raises:
        OSError: it, or its parent, is not a folder or is not writable.
    """
    nearest = next(parent for parent in (folder, *folder.absolute().parents) if parent.exists())
    if not nearest.is_dir():
        raise NotADirectoryError(f"{nearest} is not a folder")
    if not os.access(nearest, os.W_OK):
        raise PermissionError(f"{nearest} may not be written to")
