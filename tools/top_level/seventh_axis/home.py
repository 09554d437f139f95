"""Where the packages of this project are installed, and which other package would be imported instead."""

import sys
from importlib.machinery import ModuleSpec, PathFinder
from importlib.metadata import PackageNotFoundError, distribution
from pathlib import Path

_ABOVE = Path(__file__).resolve().parents
HOME = next((folder for folder in _ABOVE[1:4] if (folder / "protocol" / "py.typed").is_file()), _ABOVE[1])
"""The folder of the packages: beside this one if installed, three folders up in a clone."""


def hidden(package: str) -> str:
    """Return in one sentence what hides a package of this project from an import; an empty text if nothing does."""
    return _hidden(package, HOME, "seventh-axis")


def hidden_library(package: str, distribution_name: str) -> str:
    """Return the same for a package of an installed distribution; also empty if that is not installed."""
    try:
        home = Path(str(distribution(distribution_name).locate_file("")))
    except PackageNotFoundError:
        return ""
    return _hidden(package, home.resolve(), distribution_name)


def _hidden(package: str, home: Path, owner: str) -> str:
    loaded = sys.modules.get(package)
    found = PathFinder.find_spec(package) if loaded is None else getattr(loaded, "__spec__", None)
    places = _places(found)
    if home / package in places:
        return ""
    if not places:
        return f"{package}: the package of {owner} is not on the path; add {home} to it"
    return f"{places[0]} hides the package {package} of {owner}; rename it, or see 'Name clashes' in docs/install.md"


def _places(found: ModuleSpec | None) -> list[Path]:
    """Return the folders of a package, or the file of a module."""
    if found is None:
        return []
    places = found.submodule_search_locations or ([found.origin] if found.origin else [])
    return [Path(place).resolve() for place in places]
