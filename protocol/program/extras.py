"""The optional dependencies and their extras, and the message for a missing one."""

from collections.abc import Mapping
from importlib.util import find_spec

EXTRAS: Mapping[str, tuple[str, ...]] = {
    "planner": (
        "numpy", "numba", "scipy", "matplotlib", "trimesh", "rtree", "embreex", "mapbox_earcut", "plyfile",
    ),
    "tools": ("control", "threadpoolctl"),
    "adaptive": ("small_gicp", "gpytoolbox"),
    "test": ("pytest", "xdist", "hypothesis", "ruckig", "py_opw_kinematics", "coal", "ortools"),
    "completion": ("argcomplete",),
}  # fmt: skip
"""The modules of each extra. `tools` includes those of `planner`, and `test` includes both."""

_WITH_TOOLS = {"tools.tune", "tune"}
"""Modules that need the extra `tools`, whichever import fails first."""


def missing_extra(error: BaseException, *command: str) -> str:
    """Return one sentence with the extra that contains a missing module; empty for any other error.

    Args:
        error: the exception of the import.
        command: the program and its first argument.
    """
    if not isinstance(error, ModuleNotFoundError) or error.name is None:
        return ""
    module = error.name.partition(".")[0]
    extra = next((extra for extra, modules in EXTRAS.items() if module in modules), "")
    if not extra:
        return ""
    if extra == "planner" and _WITH_TOOLS.intersection(command):
        extra = "tools"
    return f"{module} is not installed: needs 'seventh-axis[{extra}]'; run: pip install 'seventh-axis[{extra}]'"


def need(module: str) -> None:
    """Raise the error of a missing import now, for a module that only the end of long work imports.

    Raises:
        ModuleNotFoundError: It is not installed.
    """
    if find_spec(module) is None:
        raise ModuleNotFoundError(f"No module named {module!r}", name=module)


def is_installed(extra: str) -> bool:
    """Return whether all modules of an extra can be found."""
    return all(find_spec(module) for module in EXTRAS[extra])
