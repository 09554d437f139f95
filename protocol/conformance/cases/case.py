"""A case: one way to hold a table against one clause."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

from protocol.conformance.profile.clauses import Clause, specification

if TYPE_CHECKING:
    from protocol.conformance.judgement.rig import Rig

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
"""Every case by its id, as far as its file has been imported; `catalog` has them all."""


def case(identifier: str, *needs: str, travel_deg: float = 0.0) -> Callable[[Run], Run]:
    """Register a function as the case of a clause; its docstring says how it is done."""

    def register(run: Run) -> Run:
        assert identifier not in CASES, identifier
        clause = specification()[identifier.partition(":")[0]]
        how = " ".join((run.__doc__ or "").split())
        CASES[identifier] = Case(identifier, clause, how, frozenset(needs), travel_deg, run)
        return run

    return register
