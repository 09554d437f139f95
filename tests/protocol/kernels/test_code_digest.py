"""Changes that affect the digest of a function, and changes that do not: a small package is edited and read again."""

import importlib
import math
import sys
from collections.abc import Callable, Iterator
from enum import IntEnum
from pathlib import Path
from typing import NamedTuple

import numba
import numpy as np
import pytest

from protocol.kernels.code_digest import NoDigestError, code_digest

SIZES = '''"""Sizes."""
from enum import IntEnum
from typing import NamedTuple

class Kind(IntEnum):
    ROUND = 1
    FLAT = 2

class Box(NamedTuple):
    """A box."""
    length: float
    width: float = 2.0
'''
PARTS = '''"""Parts."""
FACTOR = 1.5
TEXTS = ("a", "b")

def unused(x):
    return 7

def grown(x, by=1.0, *, more=0):
    """Return it grown."""
    return x + by + more
'''
WHOLE = '''"""The whole."""
import math
import parts
from parts import FACTOR, grown
from sizes import Box, Kind

def outer(x):
    """Return something."""
    box = Box(x)
    inner = [side * 2.0 for side in (box.length, box.width)]
    if inner[0] > FACTOR and len(parts.TEXTS) == 2:  # a comparison
        return grown(inner[1], more=int(Kind.FLAT)) + math.sqrt(x)
    return 0.0
'''


@pytest.fixture
def digest(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Callable[..., str]]:
    """Return the digest of `outer` after some text of one of the files was replaced."""
    monkeypatch.syspath_prepend(str(tmp_path))
    monkeypatch.setattr(sys, "dont_write_bytecode", True)

    def read(file: str = "whole.py", old: str = "", new: str = "") -> str:
        sources = {
            "sizes.py": SIZES, "boxes.py": SIZES, "parts.py": PARTS, "growth.py": PARTS, "whole.py": WHOLE,
        }  # fmt: skip
        assert sources[file].count(old) >= 1, old
        sources[file] = sources[file].replace(old, new, 1)
        for name, text in sources.items():
            (tmp_path / name).write_text(text)
            sys.modules.pop(name.removesuffix(".py"), None)
        importlib.invalidate_caches()
        return code_digest(importlib.import_module("whole").outer)

    yield read
    for name in ("sizes", "boxes", "parts", "growth", "whole"):
        sys.modules.pop(name, None)


@pytest.mark.parametrize(
    ("file", "old", "new"),
    [
        ("whole.py", "# a comparison", "# another comment"),
        ("whole.py", "# a comparison", ""),
        ("whole.py", '"""Return something."""', '"""Return something else,\n\n    at length.\n    """'),
        ("whole.py", '    """Return something."""\n', ""),
        ("whole.py", "import math\n", "\n\n\nimport math\n"),
        ("whole.py", "box = Box(x)", "box = Box( x )"),
        ("parts.py", '"""Return it grown."""', '"""Grow."""'),
        ("parts.py", '"""Parts."""\n', ""),
        ("parts.py", "return 7", "return 8"),
        ("parts.py", "def unused(x):\n    return 7\n", ""),
        ("sizes.py", '"""A box."""', '"""A block."""'),
    ],
)
def test_what_is_not_code_that_runs_does_not_count(digest: Callable[..., str], file: str, old: str, new: str) -> None:
    assert digest(file, old, new) == digest()


@pytest.mark.parametrize(
    ("file", "old", "new"),
    [
        ("whole.py", "side * 2.0", "side * 2"),
        ("whole.py", "side * 2.0", "2.0 * side"),
        ("whole.py", "return 0.0", "return -0.0"),
        ("whole.py", "> FACTOR", ">= FACTOR"),
        ("whole.py", "def outer(x):", "def outer(x, y=1):"),
        ("whole.py", "math.sqrt", "math.cbrt"),
        ("whole.py", "from parts import FACTOR", "FACTOR = 2.5\nfrom parts import TEXTS"),
        ("whole.py", "inner[1], more", "inner[0], more"),
        ("parts.py", "FACTOR = 1.5", "FACTOR = 1.25"),
        ("parts.py", "FACTOR = 1.5", "FACTOR = 3 / 2 + 1e-16 * 3"),
        ("parts.py", 'TEXTS = ("a", "b")', 'TEXTS = ("a",)'),
        ("parts.py", "x + by", "x - by"),
        ("parts.py", "by=1.0", "by=1"),
        ("parts.py", "more=0", "more=1"),
        ("whole.py", "from sizes import Box, Kind", "from sizes import Kind\nfrom boxes import Box"),
        ("whole.py", "from parts import FACTOR, grown", "from parts import FACTOR\nfrom growth import grown"),
        ("sizes.py", "FLAT = 2", "FLAT = 3"),
        ("sizes.py", "width: float = 2.0", "width: float = 2.5"),
        ("sizes.py", "length: float\n    width: float = 2.0", "width: float\n    length: float = 2.0"),
        ("sizes.py", "width: float = 2.0", "width: float = 2.0\n    height: float = 1.0"),
    ],
)
def test_what_a_function_computes_counts_in_all_files(
    digest: Callable[..., str], file: str, old: str, new: str
) -> None:
    if new.startswith("FACTOR = 2.5"):
        new = "FACTOR = 2.5\nfrom parts import TEXTS, grown\n#"
    assert digest(file, old, new) != digest()


def test_a_function_that_reads_a_variable_without_value_has_none() -> None:
    value = 1

    def reader() -> int:
        return value  # noqa: F821  # that is the test

    del value
    with pytest.raises(NoDigestError):
        code_digest(reader)


def test_functions_that_call_each_other_have_a_digest() -> None:
    def even(n: int) -> bool:
        return n == 0 or odd(n - 1)

    def odd(n: int) -> bool:
        return n != 0 and even(n - 1)

    assert code_digest(even) != code_digest(odd)
    assert code_digest(even) == code_digest(even)


class Sign(IntEnum):
    PLUS = 1


class OtherSign(IntEnum):
    PLUS = 1


def math_of(x: float) -> float:
    return x + 1.0


def holding_itself() -> list[object]:
    result: list[object] = []
    result.append(result)
    return result


def of_a_local_class() -> object:
    class Local(NamedTuple):
        x: float

    return Local(1.0)


def closure_over(value: object) -> Callable[[], object]:
    return lambda: value


@pytest.mark.parametrize(
    ("one", "other"),
    [
        (1, 1.0),
        (1, True),
        (0.0, -0.0),
        ((1, 2), [1, 2]),
        (((1,), 2), (1, (2,))),
        (("a", "b"), ("ab",)),
        (np.zeros(2), np.zeros(2, dtype=np.float32)),
        (np.zeros((2, 1)), np.zeros((1, 2))),
        (np.float32(1.0), np.float64(1.0)),
        (math.sin, math.cos),
        (np.sin, np.cos),
        (Sign.PLUS, OtherSign.PLUS),
        (numba.njit(math_of), numba.njit(fastmath=True)(math_of)),
    ],
)
def test_values_that_differ_have_digests_that_differ(one: object, other: object) -> None:
    assert code_digest(closure_over(one)) != code_digest(closure_over(other))
    assert code_digest(one) != code_digest(other)


@pytest.mark.parametrize(
    "value",
    [
        object(),
        sys.stdout,
        {"a": 1},
        Path(),
        NoDigestError,
        np.array([{}]),
        numba.int32,
        np.random.normal,
        np.vectorize(math_of),
        holding_itself(),
        of_a_local_class(),
    ],
)
def test_a_function_that_reads_something_else_has_none(value: object) -> None:
    with pytest.raises(NoDigestError):
        code_digest(closure_over(value))
