"""The fixture's table on a pseudo-terminal: it takes faults, and does not continue after the test."""

import time
from pathlib import Path

import pytest

from emulator.control_client import request
from protocol import ReplyTimeout
from protocol.conformance.pytest.fixture import RotaryTable, pty_emulator

pytestmark = pytest.mark.realtime


def test_a_table_on_a_pty_takes_faults(tmp_path: Path) -> None:
    with pty_emulator(tmp_path) as (url, control), RotaryTable(url, control, None) as table:
        assert table.control is not None
        request(table.control, "fault-silence")
        with pytest.raises(ReplyTimeout):
            table.client.position_deg()
        request(table.control, "clear-faults")
        assert table.client.position_deg() == 0


def test_a_table_is_stopped_though_the_test_closed_its_port(tmp_path: Path) -> None:
    with pty_emulator(tmp_path) as (url, control):
        with RotaryTable(url, control, None) as table:
            table.client.move_to(300)
            table.client.close()
        reference_deg = [request(control, "state")["reference_deg"]]
        for _ in range(50):
            time.sleep(0.1)
            reference_deg.append(request(control, "state")["reference_deg"])
            if reference_deg[-1] == reference_deg[-2]:
                break
    assert 0 < reference_deg[-1] < 100
