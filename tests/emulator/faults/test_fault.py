"""The catalog of faults, with the same names and numbers everywhere."""

import json
import math
import re
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import pytest

from emulator.config.table_config import ConfigError, load_config
from emulator.faults import fault
from emulator.faults.fault import KINDS, FaultError, fault_from, parameters_of
from emulator.server.control_commands import COMMANDS
from emulator.table.table import Table
from protocol.bench import Fault, TableStatus
from tests.emulator.quiet_stand import QuietStand

EXAMPLE: dict[str, dict[str, float]] = {
    "drop": {"probability": 0.3},
    "flip": {"probability": 0.1},
    "delay": {"seconds": 0.2},
    "half-reply": {"bytes": 3},
    "late-reply": {"seconds": 2.0},
    "silence": {},
    "hang-up": {"for_s": 2.0},
    "wrong-baud": {"baud": 4800},
    "stall": {},
    "extra-load": {"torque_Nm": 0.3},
    "supply-sag": {"supply_V": 3.0},
    "stuck-pwm": {"duty": 0.3},
    "one-sided": {"direction": 1},
    "lost-counts": {"probability": 0.1},
    "swapped-encoder": {},
    "dead-encoder": {},
    "missed-trigger": {"probability": 1.0},
    "bounced-trigger": {"edges": 3, "within_s": 0.02},
}


def test_every_fault_has_an_example_here() -> None:
    assert EXAMPLE.keys() == KINDS.keys()


@pytest.mark.parametrize("kind", KINDS)
def test_the_three_ways_take_the_same_names_and_numbers(kind: str, tmp_path: Path) -> None:
    numbers = EXAMPLE[kind] | {"at_s": 1.0}
    file = tmp_path / "faulty.toml"
    file.write_text(
        "[[faults]]\n" + "".join(f"{key} = {json.dumps(value)}\n" for key, value in {"fault": kind, **numbers}.items())
    )
    (from_file,) = load_config(file).faults
    stand = QuietStand()
    COMMANDS[f"fault-{kind}"].run(stand, numbers)
    assert stand.done == [from_file] == [fault_from(kind, numbers)]


@pytest.mark.parametrize(
    ("kind", "numbers", "words"),
    [
        ("gremlins", {}, "'gremlins' is not a fault; allowed are drop, "),
        ("drop", {}, "drop: probability is missing; it must be a number from 0 to 1"),
        ("drop", {"probability": 2}, "drop: probability is 2; it must be a number from 0 to 1"),
        ("drop", {"probability": math.nan}, "drop: probability is nan"),
        (
            "drop",
            {"probability": 1, "direction": 0.5},
            "drop: direction is 0.5; it must be a whole number from -1 to 1",
        ),
        ("bounced-trigger", {"edges": 2.5, "within_s": 1}, "bounced-trigger: edges is 2.5; it must be a whole number"),
        ("stall", {"at_command": 1.5}, "stall: at_command is 1.5; it must be a whole number"),
        ("stall", {"force": 2}, "stall: force is not a parameter; allowed are at_s, at_command, for_s"),
        ("half-reply", {"bytes": 2, "for_s": 1}, "half-reply: for_s is not a parameter"),
        ("stall", {"at_s": 1, "at_command": 1}, "stall: at_s and at_command are both given"),
    ],
)
def test_what_is_no_fault_is_refused_in_one_line(
    kind: str, numbers: dict[str, float], words: str, tmp_path: Path
) -> None:
    with pytest.raises(FaultError, match=words):
        fault_from(kind, numbers)
    file = tmp_path / "faulty.toml"
    file.write_text(
        "[[faults]]\n"
        + "".join(f"{key} = {json.dumps(value).lower()}\n" for key, value in {"fault": kind, **numbers}.items())
    )
    with pytest.raises(ConfigError, match=f"faulty.toml: faults: {words}"):
        load_config(file)


class Seen(NamedTuple):
    """The observations of a client and of the table's state in a short session."""

    hung_up: bool
    replies: list[bytes]
    states: list[TableStatus]


def session_with(*faults: Fault) -> Seen:
    table = Table(load_config(), seed=1)
    for one in faults:
        table.inject(one)
    seen = Seen(table.hung_up, [], [])
    for line in (b"H\r", b"S 40\r", b"A 100\r", b"P 8\r", b"L\r", b"P -4\r", b"L\r", b"H\r"):
        table.receive(line)
        table.advance(50)
        table.trigger()
        for _ in range(4):
            seen.replies.append(table.transmit())
            table.advance(50)
        seen.states.append(table.status())
    return seen


@pytest.mark.parametrize("kind", KINDS)
def test_every_fault_has_an_effect(kind: str) -> None:
    assert session_with() == session_with()
    assert session_with(fault_from(kind, EXAMPLE[kind])) != session_with()


class Gremlins(Fault, kind="gremlins"):
    """No fault."""


def test_a_fault_without_effect_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(fault, "KINDS", {**KINDS, Gremlins.kind: Gremlins})
    with pytest.raises(FaultError, match=r"gremlins has no effect on this table; allowed are \w+"):
        session_with(fault_from("gremlins", {}))
    with pytest.raises(FaultError, match="gremlins has no effect"):
        Table(replace(load_config(), faults=(fault_from("gremlins", {}),)))


def test_every_fault_has_its_row_in_the_docs() -> None:
    page = (Path(__file__).parents[3] / "docs" / "faults.md").read_text(encoding="utf-8")
    rows = dict(re.findall(r"^\| `([a-z-]+)` \| ([^|]*)\|", page, re.MULTILINE))
    assert rows.keys() == KINDS.keys()
    for kind, numbers in rows.items():
        assert re.findall(r"`(\w+)`", numbers) == [
            parameter.name for parameter in parameters_of(kind) if parameter.name not in {"at_s", "at_command", "for_s"}
        ], kind


def test_help_and_parameters_agree() -> None:
    for kind in KINDS:
        assert COMMANDS[f"fault-{kind}"].parameters == parameters_of(kind)
