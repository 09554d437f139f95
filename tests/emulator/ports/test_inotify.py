import os
import sys
import tty
from collections.abc import Iterator
from pathlib import Path

import pytest

from emulator.ports.inotify import CLOSED, OPENED, WRITTEN, DeviceWatch

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="inotify is Linux's")


@pytest.fixture
def device() -> Iterator[Path]:
    server, device = os.openpty()
    tty.setraw(device)
    yield Path(os.ttyname(device))
    os.close(device)
    os.close(server)


@pytest.fixture
def watch(device: Path) -> Iterator[DeviceWatch]:
    watch = DeviceWatch.start(device)
    assert watch is not None
    yield watch
    watch.close()


def open_device(device: Path) -> int:
    return os.open(device, os.O_RDWR | os.O_NOCTTY)


def test_events_come_in_their_order(device: Path, watch: DeviceWatch) -> None:
    client = open_device(device)
    os.write(client, b"H")
    os.close(client)
    assert list(watch.events()) == [OPENED, WRITTEN, CLOSED]
    assert list(watch.events()) == []


def test_openings_in_a_row_are_told_apart(device: Path, watch: DeviceWatch) -> None:
    clients = [open_device(device) for _ in range(3)]
    assert list(watch.events()) == [OPENED] * 3
    for client in clients:
        os.close(client)
    assert list(watch.events()) == [CLOSED] * 3


def test_other_devices_are_not_reported(watch: DeviceWatch) -> None:
    server, other = os.openpty()
    os.close(other)
    os.close(server)
    assert list(watch.events()) == []


def test_a_device_that_is_not_there_has_no_watch(tmp_path: Path) -> None:
    assert DeviceWatch.start(tmp_path / "none") is None
