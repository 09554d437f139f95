"""Requests and answers, without a socket."""

import json

import pytest

from emulator.control_commands import answer
from tests.emulator.quiet_stand import QuietStand


def test_each_command_does_what_it_says(stand: QuietStand) -> None:
    for name in ("trigger", "reset", "quit"):
        assert json.loads(answer(json.dumps({"command": name}).encode(), stand)) == {"ok": True}
    answer(b'{"command": "load-torque", "torque_Nm": -0.25}', stand)
    answer(b'{"command": "time-scale", "time_scale": 10}', stand)
    assert stand.done == ["trigger", "reset", "quit", -0.25]
    assert stand.time_scale == 10.0


def test_state_shows_all_that_the_table_shows(stand: QuietStand) -> None:
    reply = json.loads(answer(b'{"command": "state"}', stand))
    assert reply == {"ok": True, "time_scale": 1.0, **stand.status()._asdict()}


@pytest.mark.parametrize(
    ("line", "words"),
    [
        (b"", "JSON"),
        (b"trigger", "JSON"),
        (b"\xff\xfe", "JSON"),
        (b"[" * 3000, "JSON"),
        (b"[]", "object"),
        (b"{}", "names its command"),
        (b'{"command": 1}', "names its command"),
        (b'{"command": "dance"}', "'dance' is no command; there are trigger"),
        (b'{"command": "trigger", "now": 1}', "takes no parameter"),
        (b'{"command": "load-torque"}', "takes torque_Nm"),
        (b'{"command": "load-torque", "torque_Nm": "1"}', "must be a number"),
        (b'{"command": "load-torque", "torque_Nm": true}', "must be a number"),
        (b'{"command": "load-torque", "torque_Nm": NaN}', "must be a number"),
        (b'{"command": "load-torque", "torque_Nm": 1e400}', "must be a number"),
        (b'{"command": "time-scale", "time_scale": 0}', "from 0.001"),
        (b'{"command": "preset", "count": 0.5}', "count must be a whole number from -2147483648 to 2147483647"),
    ],
)
def test_a_bad_request_is_answered_with_a_sentence_and_changes_nothing(
    stand: QuietStand, line: bytes, words: str
) -> None:
    reply = json.loads(answer(line, stand))
    assert reply["ok"] is False
    assert words in reply["error"]
    assert stand.done == []
