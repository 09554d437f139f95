from dataclasses import dataclass

import pytest

from protocol.files.data_file import DataFileError
from protocol.files.toml_section import quantity, section
from protocol.files.toml_table import TomlTable


@dataclass(frozen=True)
class Inner:
    size_mm: float = quantity(above=0, at_most=10)
    is_open: bool = quantity()


@dataclass(frozen=True)
class Outer:
    name: str
    words: tuple[str, ...]
    inner: Inner
    teeth: int = quantity(at_least=1, at_most=9)
    extra: object = None


DEFAULTS = {"name": "disc", "words": [], "teeth": 3, "inner": {"size_mm": 2, "is_open": True}}


def outer(**values: object) -> Outer:
    return section(Outer, TomlTable("cell.toml", values), DEFAULTS, extra="known")


def test_what_a_file_leaves_out_is_the_default() -> None:
    assert outer() == Outer("disc", (), Inner(2.0, is_open=True), 3, "known")
    assert outer(teeth=4, words=["a"], inner={"is_open": False}) == Outer(
        "disc", ("a",), Inner(2.0, is_open=False), 4, "known"
    )


@pytest.mark.parametrize(
    ("values", "message"),
    [
        (
            {"teet": 4},
            "cell.toml: teet is not a known key; known are extra, inner, name, teeth, words; did you mean teeth",
        ),
        ({"inner": {"size_mm": 11}}, "inner.size_mm is 11; it must be a finite number above 0 and at most 10"),
        ({"inner": {"size": 1}}, "inner.size is not a known key; known are is_open, size_mm"),
        ({"inner": 1}, "inner is 1; it must be a table"),
        ({"teeth": 0}, "teeth is 0; it must be a whole number from 1 to 9"),
    ],
)
def test_what_is_not_allowed_is_refused(values: dict[str, object], message: str) -> None:
    with pytest.raises(DataFileError, match=message):
        outer(**values)


def test_a_key_without_default_is_required() -> None:
    with pytest.raises(DataFileError, match="size_mm is missing; it must be a finite number above 0"):
        section(Inner, TomlTable("cell.toml", {"is_open": True}), {})
    with pytest.raises(DataFileError, match="words is missing; it must be a list of texts"):
        section(Outer, TomlTable("cell.toml", {"name": "a"}), {})
