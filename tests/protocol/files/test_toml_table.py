from collections.abc import Callable
from pathlib import Path

import pytest

from protocol.files.data_file import DataFileError
from protocol.files.toml_table import TomlTable

FILE = Path("cell.toml")


def table(**values: object) -> TomlTable:
    return TomlTable(FILE, values)


def test_values_are_read_with_their_types() -> None:
    values = table(radius_mm=5, name="disc", limits=[1, 2.5], kind="b", inner={"x": 1.0}, rows=[{"y": 2}, {"y": 3}])
    assert values.number("radius_mm") == 5.0
    assert values.text("name") == "disc"
    assert values.numbers("limits", 2) == (1.0, 2.5)
    assert values.choice("kind", ("a", "b")) == "b"
    assert values.table("inner").number("x") == 1.0
    assert [row.number("y") for row in values.tables("rows", 2)] == [2.0, 3.0]
    values.finish()


def test_an_absent_key_takes_its_default() -> None:
    values = table()
    assert values.number("radius_mm", 5.0) == 5.0
    assert values.text("name", "disc") == "disc"
    assert values.numbers("limits", 2, (1.0, 2.0)) == (1.0, 2.0)
    assert values.choice("kind", ("a", "b"), "a") == "a"
    values.table("inner").finish()


@pytest.mark.parametrize(
    ("read", "value", "message"),
    [
        (lambda t: t.number("key", above=0.0), 0, "cell.toml: key is 0; it must be a finite number above 0"),
        (lambda t: t.number("key", at_least=1.0, at_most=2.0), 3, "key is 3; .* at least 1 and at most 2"),
        (lambda t: t.number("key"), float("inf"), "key is inf; it must be a finite number"),
        (lambda t: t.number("key"), 10**400, r"key is 10+\.\.\.; it must be a finite number"),
        (lambda t: t.number("key"), True, "key is True"),
        (lambda t: t.numbers("key", 2), [1], r"key is \[1\]; it must be a list of 2 finite numbers"),
        (lambda t: t.numbers("key", 1), ["1"], r"key is \['1'\]"),
        (lambda t: t.numbers("key", 1), 1, "key is 1"),
        (lambda t: t.switch("key"), 1, "key is 1; it must be true or false"),
        (lambda t: t.count("key", at_least=1, at_most=9), 2.0, "key is 2.0; it must be a whole number from 1 to 9"),
        (lambda t: t.tables("key"), [1], r"key is \[1\]; it must be a list of tables"),
        (lambda t: t.text("key"), "", "key is ''; it must be a text"),
        (lambda t: t.choice("key", ("a", "b")), "c", "key is 'c'; it must be one of a, b"),
        (lambda t: t.choice("key", ("a", "b")), [], r"key is \[\]"),
        (lambda t: t.table("key"), 1, "key is 1; it must be a table"),
        (lambda t: t.tables("key", 2), [{}], r"key is \[{}\]; it must be a list of 2 tables"),
        (lambda t: t.number("other"), 1, "cell.toml: other is missing; it must be a finite number"),
    ],
)
def test_a_value_that_is_not_allowed_is_refused(
    read: Callable[[TomlTable], object], value: object, message: str
) -> None:
    with pytest.raises(DataFileError, match=message):
        read(table(key=value))


@pytest.mark.parametrize("text", ["", "1", "2197:27", "2197/0", "-1/2", "1/-2", "1.5/2", "1/2/3", "9" * 5000 + "/1"])
def test_a_text_that_is_not_a_fraction_of_integers_is_refused(text: str) -> None:
    with pytest.raises(DataFileError, match="a finite number, or a fraction such as"):
        table(key=text).number("key", fraction=True)
    assert table(key="7/4").number("key", fraction=True) == 1.75


def test_a_key_that_nothing_reads_is_refused_with_those_that_are_known() -> None:
    values = table(radius_mm=5.0, raduis_mm=6.0)
    values.number("radius_mm")
    values.number("height_mm", 1.0)
    with pytest.raises(DataFileError, match="raduis_mm is not a known key; known are height_mm, radius_mm"):
        values.finish()


def test_an_inner_key_is_named_by_its_whole_path() -> None:
    with pytest.raises(DataFileError, match=r"cell.toml: outer.inner.x is missing"):
        table(outer={"inner": {}}).table("outer").table("inner").number("x")


@pytest.mark.parametrize("content", [b"a = ", b"a = 1\na = 2", b"\xff"])
def test_a_file_that_is_not_toml_is_refused(tmp_path: Path, content: bytes) -> None:
    file = tmp_path / "bad.toml"
    file.write_bytes(content)
    with pytest.raises(DataFileError, match=r"bad.toml: (is not TOML|cannot be read: it is not text)"):
        TomlTable.load(file)
