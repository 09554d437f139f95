"""Each key that the code reads has its row in the reference."""

import ast
import inspect
from collections.abc import Iterator
from dataclasses import fields, is_dataclass
from pathlib import Path

import pytest

from emulator.config.table_config import load_config
from emulator.faults.fault import KINDS, parameters_of
from planner.cell.cell import Table
from planner.cell.workpiece import CLASSES
from protocol.conformance.profile.profile import load_profile
from protocol.files.toml_table import TomlTable
from tools.reference.keys import Key, comments, key_page
from tools.reference.planner_keys import arm_keys, bodies_keys, scan_keys
from tools.reference.profile_keys import profile_keys
from tools.reference.recorded_keys import READERS, recorded_keys
from tools.reference.table_keys import table_keys, table_page
from tools.reference.units import unit

ROOT = Path(__file__).parents[3]


@pytest.fixture(scope="module")
def planner_keys() -> dict[str, Key]:
    return {key.name: key for key in (*scan_keys(), *arm_keys(), *bodies_keys())}


def names(section: object, where: str = "") -> Iterator[str]:
    for entry in fields(section):  # type: ignore[arg-type]  # a section is a dataclass
        value = getattr(section, entry.name)
        if is_dataclass(value):
            yield from names(value, f"{where}{entry.name}.")
        elif not isinstance(value, tuple) or entry.name.endswith("_command"):
            yield where + entry.name


def literal_keys() -> Iterator[tuple[str, str]]:
    """Yield each key that the planner's source names in a call of a reader, with its file."""
    for file in (ROOT / "planner").rglob("*.py"):
        text = file.read_text(encoding="utf-8")
        if "TomlTable" not in text:
            continue
        for call in ast.walk(ast.parse(text)):
            if not (isinstance(call, ast.Call) and isinstance(call.func, ast.Attribute) and call.func.attr in READERS):
                continue
            if call.args and isinstance(call.args[0], ast.Constant):
                yield file.name, str(call.args[0].value)


def test_each_key_that_the_planners_source_names_has_its_row(planner_keys: dict[str, Key]) -> None:
    rows = {name.rpartition(".")[2] for name in planner_keys}
    asked = set(literal_keys())
    assert len(asked) > 20
    assert not [(file, key) for file, key in asked if key not in rows]


def test_each_key_that_a_class_of_the_planner_declares_has_its_row(planner_keys: dict[str, Key]) -> None:
    declared = {f"cell.table.{item.name}" for item in fields(Table)}
    declared |= {f"workpiece.{item.name}" for shape in CLASSES.values() for item in fields(shape)}
    assert not declared - {"workpiece.middle_mm"} - set(planner_keys)


def test_a_key_of_the_planner_states_what_is_allowed_its_default_and_its_meaning(
    planner_keys: dict[str, Key],
) -> None:
    overlap = planner_keys["path.overlap"]
    assert (overlap.allowed, overlap.default) == ("a finite number at least 0 and at most 0.9", "0.2")
    assert planner_keys["path.time_step_s"].default is None
    assert planner_keys["workpiece.mesh"].default == ""
    assert all(key.allowed and key.notes for key in planner_keys.values())


def test_each_method_that_reads_a_value_is_recorded() -> None:
    methods = {name: inspect.signature(method) for name, method in vars(TomlTable).items() if callable(method)}
    by_key = {name for name, signature in methods.items() if "key" in signature.parameters and name[0] != "_"}
    assert by_key - {"name_of", "refuse", "table", "tables", "one_or_more"} == set(READERS)


def test_recording_leaves_the_readers_as_they_were() -> None:
    before = [getattr(TomlTable, name) for name in READERS]
    with pytest.raises(ZeroDivisionError):
        recorded_keys(lambda: 1 / 0)
    assert [getattr(TomlTable, name) for name in READERS] == before


def test_each_key_of_a_table_has_its_row() -> None:
    assert [key.name for key in table_keys()] == list(names(load_config()))


def test_each_fault_has_its_row_with_its_keys() -> None:
    page = table_page()
    for name in KINDS:
        row = next(line for line in page.splitlines() if line.startswith(f"| `{name}` |"))
        assert all(f"`{parameter.name}`: {parameter.allowed}" in row for parameter in parameters_of(name))


def test_each_key_of_a_profile_has_its_row() -> None:
    assert [key.name for key in profile_keys()] == [*list(names(load_profile()))[:-1], "waive.CLAUSE"]


def test_what_a_key_of_a_profile_may_be_comes_from_its_refusals() -> None:
    allowed = {key.name: key.allowed for key in profile_keys()}
    assert allowed["serial.decimals"] == "a whole number from 1 to 6"
    assert allowed["serial.error_replies"] == "true or false"
    assert "at most limits.speed_deg_s, 40" in allowed["motion.speed_deg_s"]


@pytest.mark.parametrize(
    ("key", "expected"),
    [
        ("motor.torque_constant_Nm_A", "Nm/A"),
        ("limits.acceleration_deg_s2", "deg/s2"),
        ("gains.hold.proportional_duty_s_deg", "s/deg"),
        ("friction.viscous_Nm_s", "Nm s"),
        ("path.time_step_s", "s"),
        ("gears.ratio", ""),
    ],
)
def test_a_unit_is_the_end_of_the_name(key: str, expected: str) -> None:
    assert unit(key) == expected


def test_a_page_has_a_table_for_each_section() -> None:
    keys = [Key("a.x_mm", "a number", "1", "left | right"), Key("a.y_s", "a number", None, "wait")]
    page = key_page("Title", "Text.", keys)
    assert "## `[a]`" in page
    assert "| `x_mm` | mm | a number | `1` | left \\| right |" in page
    assert "| `y_s` | s | a number | required | wait |" in page


def test_comments_are_those_behind_the_keys() -> None:
    assert comments('[a]  # section\n# above\nx = 1  # one\ny = "t"\n[a.b]\nx = []  # none, such as ["#"]\n') == {
        "a.x": "one",
        "a.b.x": 'none, such as ["#"]',
    }
