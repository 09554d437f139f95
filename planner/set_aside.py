"""Results of an earlier command in the same folder: set aside when a command begins, so that none passes for its own.

What the earlier command wrote goes to the subfolder `previous` and replaces what lies there. So a command that is
refused leaves no results in its folder, and none are lost.
"""

from collections.abc import Iterable, Sequence
from pathlib import Path

from planner.errors import PlannerError

PREVIOUS = "previous"


def set_aside(folder: Path, names: Iterable[str], keep: Sequence[Path] = ()) -> None:
    """Move files of these names in a folder to its subfolder `previous`.

    Args:
        folder: the folder; it need not exist.
        names: what the command writes there.
        keep: files that the command reads; they stay where they are.

    Raises:
        PlannerError: one of `keep` would be overwritten, or a file cannot be moved.
    """
    aside = folder / PREVIOUS
    found = [folder / name for name in names if (folder / name).is_file()]
    found = [file for file in found if not any(other.exists() and other.samefile(file) for other in keep)]
    if not found:
        return
    for file in keep:
        if file.exists() and aside.exists() and file.resolve().parent == aside.resolve():
            raise PlannerError(f"{file}: is among the former results of {folder}; write to another folder with --out")
    try:
        aside.mkdir(exist_ok=True)
        for name in names:
            (aside / name).unlink(missing_ok=True)
        for file in found:
            file.replace(aside / file.name)
    except OSError as error:
        raise PlannerError(f"{folder}: its former results cannot be set aside ({error.strerror or error})") from error
