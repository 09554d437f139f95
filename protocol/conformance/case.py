"""A case: one way to hold a table against one clause."""

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from protocol.conformance.clauses import Clause, specification

if TYPE_CHECKING:
    from protocol.conformance.rig import Rig

Run = Callable[["Rig"], None]


@dataclass(frozen=True)
class Case:
    """One case of the suite.

    Attributes:
        id: the clause's number, with a name after a colon where a clause has several cases.
        clause: what the table is held against.
        how: what the case does, in a sentence.
        needs: the capabilities without which it is skipped.
        travel_deg: how far a conformant table turns, each way from where the session began.
        run: does it; raises `NonconformityError`.
    """

    id: str
    clause: Clause
    how: str
    needs: frozenset[str]
    travel_deg: float
    run: Run


CASES: dict[str, Case] = {}
"""Every case by its id."""


def case(identifier: str, *needs: str, travel_deg: float = 0.0) -> Callable[[Run], Run]:
    """Register a function as the case of a clause; its docstring says how it is done."""

    def register(run: Run) -> Run:
        assert identifier not in CASES, identifier
        clause = specification()[identifier.partition(":")[0]]
        how = " ".join((run.__doc__ or "").split())
        CASES[identifier] = Case(identifier, clause, how, frozenset(needs), travel_deg, run)
        return run

    return register


def all_cases() -> list[Case]:
    """Return every case in the order of the specification."""
    import protocol.conformance.cases  # noqa: F401, PLC0415  # fills the register, which this module must hold first

    return sorted(CASES.values(), key=lambda one: ([int(part) for part in re.findall(r"\d+", one.clause.number)]))


def chosen_cases(prefixes: Sequence[str]) -> list[Case]:
    """Return the cases whose id begins with one of the prefixes, numbers taken whole: `4.1/1` is not `4.1/10`.

    A prefix that ends in `$` is a whole id: `7.1/1$` is not `7.1/1:backwards`.

    Raises:
        ValueError: a prefix chooses none.
    """
    everything = all_cases()
    for prefix in prefixes:
        if not prefix:
            raise ValueError("a prefix is empty; leave the option out for all cases")
        if not any(_begins(one.id, prefix) for one in everything):
            raise ValueError(f"no case begins with {prefix}; --list shows all")
    return [one for one in everything if not prefixes or any(_begins(one.id, prefix) for prefix in prefixes)]


def only(case: Case) -> str:
    """Return the prefix that chooses this case and no other: its id, with `$` behind it where others begin so too."""
    return case.id if chosen_cases([case.id]) == [case] else f"{case.id}$"


def _begins(identifier: str, prefix: str) -> bool:
    if prefix.endswith("$"):
        return identifier == prefix[:-1]
    rest = identifier.removeprefix(prefix)
    return identifier.startswith(prefix) and not (prefix[-1:].isdigit() and rest[:1].isdigit())
