"""Planners and value factors from other packages, found by their entry points.

A package declares them in its pyproject.toml:

    [project.entry-points."seventh_axis.planners"]
    mine = "my_package.my_module:my_planner"

No module of a package is imported before its plug-in is requested by name.
"""

from collections.abc import Sequence
from importlib.metadata import EntryPoint, entry_points
from typing import Any

from planner.errors import PlannerError
from protocol.files.data_file import did_you_mean

PLANNER_GROUP = "seventh_axis.planners"
FACTOR_GROUP = "seventh_axis.factors"
_WHAT = {PLANNER_GROUP: "planner", FACTOR_GROUP: "factor"}


class PlugInError(PlannerError):
    """A plug-in that is missing, cannot be loaded, or violates its interface."""


def plug_in_names(group: str) -> list[str]:
    """Return the names of the installed plug-ins of a group, sorted."""
    return sorted({point.name for point in entry_points(group=group)})


def load_plug_in(group: str, name: str, others: Sequence[str] = ()) -> Any:  # noqa: ANN401  # checked by the caller
    """Return the object of the entry point with that name.

    Args:
        group: PLANNER_GROUP or FACTOR_GROUP.
        name: the plug-in.
        others: other allowed names, for the message.

    Raises:
        PlugInError: there is no plug-in with that name, two packages have one, or it cannot be imported.
    """
    what, points = _WHAT[group], tuple(entry_points(group=group, name=name))
    if not points:
        known = [*others, *plug_in_names(group)]
        allowed = (
            f"; allowed are {', '.join(known)}" if known else f"; no package with the entry point {group} is installed"
        )
        raise PlugInError(f"{what} {name!r}: not found{allowed}{did_you_mean(name, known)}")
    if len({point.value for point in points}) > 1:
        packages = " and ".join(sorted(_package(point) for point in points))
        raise PlugInError(f"{what} {name!r}: {packages} both provide this name; uninstall one of them")
    try:
        return points[0].load()
    except (Exception, SystemExit) as error:
        raise failure(group, name, f"cannot be loaded from {_package(points[0])}", error) from error


def failure(group: str, name: str, problem: str, error: BaseException) -> PlugInError:
    """Return the error for an exception of a plug-in, in one line."""
    message = " ".join(str(error).split())
    return PlugInError(f"{_WHAT[group]} {name!r}: {problem}: {type(error).__name__}{': ' if message else ''}{message}")


def _package(point: EntryPoint) -> str:
    return point.value if point.dist is None else f"{point.dist.name} ({point.value})"
