import os
import sys
from pathlib import Path

import pytest

from emulator.ports.device_link import DeviceLink

DEVICE = "/dev/pts/123456"
OTHER_DEVICE = "/dev/pts/654321"


def test_a_link_leads_to_the_device_until_it_is_removed(tmp_path: Path) -> None:
    path = tmp_path / "table"
    link = DeviceLink(path, DEVICE)
    assert path.readlink() == Path(DEVICE)
    assert link.replaced is None
    link.remove()
    assert list(tmp_path.iterdir()) == []


def test_a_link_that_was_left_behind_is_replaced(tmp_path: Path) -> None:
    path = tmp_path / "table"
    path.symlink_to(OTHER_DEVICE)
    link = DeviceLink(path, DEVICE)
    assert link.replaced == OTHER_DEVICE
    assert path.readlink() == Path(DEVICE)
    assert list(tmp_path.iterdir()) == [path]


def test_an_ordinary_file_is_never_overwritten(tmp_path: Path) -> None:
    path = tmp_path / "thesis.tex"
    path.write_text("three years of work")
    with pytest.raises(FileExistsError, match="is not a link to a pty"):
        DeviceLink(path, DEVICE)
    assert path.read_text() == "three years of work"


@pytest.mark.parametrize("target", ["thesis.tex", "/etc/hosts", "/dev/null", "/dev/ttyUSB0"])
def test_a_link_to_something_else_is_never_overwritten(tmp_path: Path, target: str) -> None:
    path = tmp_path / "table"
    path.symlink_to(target)
    with pytest.raises(FileExistsError):
        DeviceLink(path, DEVICE)
    assert path.readlink() == Path(target)


def test_a_directory_is_never_overwritten(tmp_path: Path) -> None:
    with pytest.raises(FileExistsError):
        DeviceLink(tmp_path, DEVICE)


def test_a_link_that_another_emulator_has_taken_over_is_left_to_it(tmp_path: Path) -> None:
    path = tmp_path / "table"
    first = DeviceLink(path, DEVICE)
    DeviceLink(path, OTHER_DEVICE)
    first.remove()
    assert path.readlink() == Path(OTHER_DEVICE)


def test_a_link_whose_place_another_file_has_taken_leads_nowhere_new(tmp_path: Path) -> None:
    path = tmp_path / "table"
    link = DeviceLink(path, DEVICE)
    path.unlink()
    path.write_text("three years of work")
    with pytest.raises(FileExistsError, match="is not a link to a pty"):
        link.lead_to(OTHER_DEVICE)
    assert path.read_text() == "three years of work"


def test_a_folder_that_is_not_there_is_an_error(tmp_path: Path) -> None:
    with pytest.raises(FileNotFoundError):
        DeviceLink(tmp_path / "none" / "table", DEVICE)


@pytest.mark.skipif(sys.platform != "linux", reason="other names of ptys")
def test_the_link_of_a_living_emulator_is_left_to_it_and_that_of_a_dead_one_is_taken(tmp_path: Path) -> None:
    path = tmp_path / "table"
    server, device = os.openpty()
    name = os.ttyname(device)
    first = DeviceLink(path, name)
    with pytest.raises(FileExistsError, match="another emulator"):
        DeviceLink(path, DEVICE)
    assert path.readlink() == Path(name)
    DeviceLink(path, name)  # its own link; the old one with the same device remained
    os.close(device)
    os.close(server)
    second = DeviceLink(path, DEVICE)
    assert second.replaced == name
    first.remove()
    assert path.readlink() == Path(DEVICE)


@pytest.mark.skipif(sys.platform != "linux", reason="other names of ptys")
def test_a_device_that_comes_back_does_not_take_the_link_of_another(tmp_path: Path) -> None:
    path = tmp_path / "table"
    link = DeviceLink(path, OTHER_DEVICE)
    server, device = os.openpty()
    DeviceLink(path, os.ttyname(device))
    with pytest.raises(FileExistsError, match="another emulator"):
        link.lead_to(DEVICE)
    assert path.readlink() == Path(os.ttyname(device))
    os.close(device)
    os.close(server)
