import sys
from pathlib import Path
from types import ModuleType

import pytest

from seventh_axis.home import HOME, hidden

PACKAGES = ("emulator", "planner", "protocol", "tools")


@pytest.mark.parametrize("package", PACKAGES)
def test_nothing_hides_a_package_where_ours_is_found_first(package: str) -> None:
    assert Path(__file__).parents[3] == HOME
    assert hidden(package) == ""


@pytest.mark.parametrize("file", ["{}.py", "{}/__init__.py"])
@pytest.mark.parametrize("package", PACKAGES)
def test_what_comes_first_on_the_path_is_named(
    package: str, file: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    other = tmp_path / file.format(package)
    other.parent.mkdir(exist_ok=True)
    other.touch()
    monkeypatch.delitem(sys.modules, package, raising=False)
    monkeypatch.syspath_prepend(tmp_path)
    named = other if other.parent == tmp_path else other.parent
    assert hidden(package).startswith(f"{named} hides the package {package} of seventh-axis; ")


def test_a_namespace_folder_does_not_hide_tools(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "tools").mkdir()
    monkeypatch.delitem(sys.modules, "tools", raising=False)
    monkeypatch.syspath_prepend(tmp_path)
    assert hidden("tools") == ""


def test_a_package_that_is_not_found_is_said_to_be_missing(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delitem(sys.modules, "emulator", raising=False)
    monkeypatch.setattr(sys, "path", [])
    assert hidden("emulator") == f"emulator: the package of seventh-axis is not on the path; add {HOME} to it"
    monkeypatch.setitem(sys.modules, "emulator", ModuleType("emulator"))  # made by hand: it comes from nowhere
    assert hidden("emulator")
