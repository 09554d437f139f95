"""The kit covers the specification, and quotes it."""

from pathlib import Path

import pytest

from protocol.conformance.cases.catalog import all_cases, chosen_cases, only
from protocol.conformance.profile.clauses import specification

PAGE = Path(__file__).parents[4] / "docs" / "protocol.md"

NOT_FOR_A_TABLE = {
    "4.5/6": "an increment over the counter's end is the case of 6.1/3",
    "7.2/5": "no rig should have a motor protect itself for a test",
}


def test_the_kit_quotes_the_page() -> None:
    page = " ".join(PAGE.read_text(encoding="utf-8").split())
    assert len(specification()) == page.count(" - **")
    assert all(f"**{number}** {level}: {text}" in page for number, level, text in specification().values())


def test_every_clause_about_the_table_has_a_case() -> None:
    covered = {case.clause.number for case in all_cases()}
    about_tables = {number for number in specification() if not number.startswith("8")}
    assert about_tables - covered == set(NOT_FOR_A_TABLE)


def test_every_case_says_how_it_is_done() -> None:
    assert all(case.how.endswith(".") for case in all_cases())


def test_cases_are_chosen_by_whole_numbers() -> None:
    assert [case.id for case in chosen_cases(["4.1/1"])] == ["4.1/1"]
    assert {case.id.partition(":")[0] for case in chosen_cases(["7.3/3"])} == {"7.3/3"}
    assert len(chosen_cases(["7", "2"])) == len(chosen_cases(["7"])) + len(chosen_cases(["2"]))
    assert chosen_cases([]) == all_cases()


def test_each_case_has_a_prefix_that_chooses_it_alone() -> None:
    for case in all_cases():
        assert chosen_cases([only(case)]) == [case]


def test_a_prefix_of_nothing_is_an_error() -> None:
    with pytest.raises(ValueError, match="no case id starts with 9"):
        chosen_cases(["9"])


def test_cases_are_in_the_order_of_the_page() -> None:
    order = list(specification())
    numbers = [order.index(case.clause.number) for case in all_cases()]
    assert numbers == sorted(numbers)
