"""The written specification agrees with itself and with the code."""

import math
import re
from itertools import groupby
from pathlib import Path

from protocol import VERBS, ErrorCode

SPECIFICATION = (Path(__file__).parents[2] / "docs" / "protocol.md").read_text(encoding="utf-8")
CLAUSES = re.findall(r"^- \*\*(\d+\.\d+)/(\d+)\*\* (\w+): (.+(?:\n  .+)*)$", SPECIFICATION, re.MULTILINE)


def test_clauses_are_numbered_without_gaps_under_their_section() -> None:
    sections = re.findall(r"^### (\d+\.\d+) ", SPECIFICATION, re.MULTILINE)
    assert [section for section, _ in groupby(CLAUSES, lambda clause: clause[0])] == sections
    for section, clauses in groupby(CLAUSES, lambda clause: clause[0]):
        numbers = [int(number) for _, number, _, _ in clauses]
        assert numbers == list(range(1, len(numbers) + 1)), section


def test_every_clause_has_a_level_and_none_was_misread() -> None:
    assert {level for _, _, level, _ in CLAUSES} == {"must", "should"}
    assert len(CLAUSES) == SPECIFICATION.count("\n- **")


def test_the_table_of_commands_is_that_of_the_code() -> None:
    rows = re.findall(r"^\| `(\w)[^`]*` \| `[^`]+` \| ([^|]+) \| (\S+) \|$", SPECIFICATION, re.MULTILINE)
    assert rows == [(verb, entry.meaning, entry.unit or "deg") for verb, entry in VERBS.items()]


def test_the_refusals_are_those_of_the_code() -> None:
    assert [text for section, _, _, text in CLAUSES if section == "5.3"] == [
        f"`{code} {code.text}`" for code in ErrorCode
    ]


def test_the_cost_of_a_decimal_is_what_geometry_says() -> None:
    rows = re.findall(r"^\| (\d) \| (\S+) deg \| (\S+) micrometers \| (\S+) mm \|", SPECIFICATION, re.MULTILINE)
    assert [int(decimals) for decimals, *_ in rows] == [1, 2, 3]
    for decimals, error_deg, arc_um, radius_mm in rows:
        arc_um_per_mm = 1000 * math.radians(0.5 * 10 ** -int(decimals))
        assert float(error_deg) == 0.5 * 10 ** -int(decimals)
        assert math.isclose(float(arc_um), arc_um_per_mm, rel_tol=1e-3)
        assert math.isclose(float(radius_mm), 25 / arc_um_per_mm, rel_tol=2e-3)
