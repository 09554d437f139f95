"""Set aside the results of an earlier command in the same folder, so that they are not taken for the new ones.

The files of the earlier command are moved to the subfolder `previous` and replace its content. So a refused command
leaves no results in its folder, and none are lost.
"""

from collections.abc import Iterable, Sequence
from pathlib import Path

from planner.errors import PlannerError

PREVIOUS = "previous"


def set_aside(folder: Path, names: Iterable[str], keep: Sequence[Path] = ()) -> None:
    """Move files of these names in a folder to its subfolder `previous`.

    Args:
        folder: the folder; it need not exist.
        names: files that the command writes there.
        keep: files that the command reads; they are not moved.

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
            raise PlannerError(f"{file}: belongs to the former results in {folder}; choose another folder with --out")
    try:
        aside.mkdir(exist_ok=True)
        for name in names:
            (aside / name).unlink(missing_ok=True)
        for file in found:
            file.replace(aside / file.name)
    except OSError as error:
        raise PlannerError(f"{folder}: cannot set aside the former results ({error.strerror or error})") from error
