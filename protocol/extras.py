"""The optional dependencies, by the extra that installs them: what is told where one is missing."""

from collections.abc import Mapping
from importlib.util import find_spec

EXTRAS: Mapping[str, tuple[str, ...]] = {
    "planner": (
        "numpy", "numba", "scipy", "matplotlib", "trimesh", "rtree", "embreex", "mapbox_earcut", "plyfile",
    ),
    "tools": ("control", "threadpoolctl"),
    "adaptive": ("small_gicp", "gpytoolbox"),
    "test": ("pytest", "xdist", "hypothesis", "ruckig", "py_opw_kinematics", "coal"),
    "completion": ("argcomplete",),
}  # fmt: skip
"""The modules of each extra; `tools` brings those of `planner` too, and `test` those of both."""

_WITH_TOOLS = {"tools.tune", "tune"}
"""What needs the extra `tools`, whichever of its modules is missed first."""


def missing_extra(error: BaseException, *command: str) -> str:
    """Return in one sentence which extra has the module that an import did not find; empty for any other error.

    Args:
        error: what the import raised.
        command: the program that needs it, and its first word.
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
