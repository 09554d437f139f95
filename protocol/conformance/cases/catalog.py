"""The catalog of all cases, and their selection by id."""

import re
from collections.abc import Sequence

import protocol.conformance.cases  # noqa: F401  # fills the register
from protocol.conformance.cases.case import CASES, Case


def all_cases() -> list[Case]:
    """Return every case in the order of the specification."""
    return sorted(CASES.values(), key=lambda one: ([int(part) for part in re.findall(r"\d+", one.clause.number)]))


def chosen_cases(prefixes: Sequence[str]) -> list[Case]:
    """Return the cases whose id starts with one of the prefixes.

    Numbers are compared as a whole: `4.1/1` does not match `4.1/10`.

    A prefix that ends in `$` is a whole id: `7.1/1$` is not `7.1/1:backwards`.

    Raises:
        ValueError: a prefix matches no case.
    """
    everything = all_cases()
    for prefix in prefixes:
        if not prefix:
            raise ValueError("a prefix is empty; omit the option to run all cases")
        if not any(_begins(one.id, prefix) for one in everything):
            raise ValueError(f"no case id starts with {prefix}; --list shows all")
    return [one for one in everything if not prefixes or any(_begins(one.id, prefix) for prefix in prefixes)]


def only(case: Case) -> str:
    """Return the prefix that selects only this case: its id, with `$` at the end where another id starts with it."""
    return case.id if chosen_cases([case.id]) == [case] else f"{case.id}$"


def _begins(identifier: str, prefix: str) -> bool:
    if prefix.endswith("$"):
        return identifier == prefix[:-1]
    rest = identifier.removeprefix(prefix)
    return identifier.startswith(prefix) and not (prefix[-1:].isdigit() and rest[:1].isdigit())
