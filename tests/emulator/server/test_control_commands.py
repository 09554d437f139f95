"""Requests and answers, without a socket."""

import json
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from emulator.server.control_commands import COMMANDS, answer
from tests.emulator.quiet_stand import QuietStand


def test_each_command_does_what_it_says(stand: QuietStand) -> None:
    for name in ("trigger", "reset", "quit"):
        assert json.loads(answer(json.dumps({"command": name}).encode(), stand)) == {"ok": True}
    answer(b'{"command": "load-torque", "torque_Nm": -0.25}', stand)
    answer(b'{"command": "time-scale", "time_scale": 10}', stand)
    assert stand.done == ["trigger", "reset 0", "quit", -0.25]
    assert stand.time_scale == 10.0


def test_state_shows_all_that_the_table_shows(stand: QuietStand) -> None:
    reply = json.loads(answer(b'{"command": "state"}', stand))
    assert reply == {"ok": True, "time_scale": 1.0, **stand.table.status()._asdict()}


def test_facts_shows_what_clients_may_rely_on(stand: QuietStand) -> None:
    facts = {"tick_hz": 1000, "counts_per_deg": 512.0, "max_speed_deg_s": 40.0, "max_acceleration_deg_s2": 100.0}
    assert json.loads(answer(b'{"command": "facts"}', stand)) == {"ok": True, **facts}


@pytest.mark.parametrize(
    ("line", "words"),
    [
        (b"", "JSON"),
        (b"trigger", "JSON"),
        (b"\xff\xfe", "JSON"),
        (b"[" * 3000, "JSON"),
        (b'{"command": "state", "command": "quit"}', "each parameter once"),
        (b'{"command": "state", "x": {"y": 1, "y": 2}}', "each parameter once"),
        (b"[]", "object"),
        (b"{}", "names its command"),
        (b'{"command": 1}', "names its command"),
        (b'{"command": "dance"}', "'dance' is not a command; allowed are trigger"),
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


NAMES = sorted({"command", *(parameter.name for command in COMMANDS.values() for parameter in command.parameters)})
SCALARS = (
    st.none()
    | st.booleans()
    | st.integers()
    | st.floats()
    | st.text()
    | st.sampled_from([10**400, -(10**4000), 2**63, 1e308, 5e-324, -0.0])
)
VALUES = st.recursive(SCALARS, lambda inner: st.lists(inner) | st.dictionaries(st.text(), inner), max_leaves=20)


@st.composite
def requests(draw: st.DrawFn) -> bytes:
    """Draw a request with mostly known name and parameters, and any values."""
    name = draw(st.sampled_from(sorted(COMMANDS)) | st.text())
    known = [parameter.name for parameter in COMMANDS[name].parameters] if name in COMMANDS else NAMES
    fields: dict[str, Any] = {"command": name}
    for key in draw(st.lists(st.sampled_from(known or NAMES) | st.sampled_from(NAMES), max_size=4)):
        fields[key] = draw(VALUES)
    return json.dumps(fields).encode()


ANY_STAND = QuietStand()


@settings(max_examples=100)
@given(requests() | st.binary() | VALUES.map(lambda value: json.dumps(value).encode()))
def test_no_request_gets_anything_but_one_line_of_answer(request: bytes) -> None:
    reply = answer(request, ANY_STAND)
    assert reply.count(b"\n") == 1
    fields = json.loads(reply)
    assert fields["ok"] is True or len(fields["error"]) < 1000


@pytest.mark.parametrize("place", [b"%s", b'{"command": %s}', b'{"command": "load-torque", "torque_Nm": %s}'])
@pytest.mark.parametrize("opening", [b"[", b'{"a":', b'[{"a":'])
def test_no_depth_of_a_request_is_too_much(stand: QuietStand, place: bytes, opening: bytes) -> None:
    closing = {b"[": b"]", b'{"a":': b"}", b'[{"a":': b"}]"}[opening]
    for depth in range(1, 1100):
        assert b'"ok": false' in answer(place % (opening * depth + b"1" + closing * depth), stand)
    assert stand.done == []


@pytest.mark.parametrize("digits", [100, 1000, 4000])
@pytest.mark.parametrize("name", ["preset", "load-torque", "time-scale", "fault-drop", "fault-half-reply"])
def test_no_number_of_a_request_is_too_long(stand: QuietStand, name: str, digits: int) -> None:
    for number in ("9" * digits, "-" + "9" * digits, "0." + "9" * digits, f"1e{digits}"):
        request = f'{{"command": "{name}", "{COMMANDS[name].parameters[0].name}": {number}}}'
        assert len(answer(request.encode(), stand)) < 500
