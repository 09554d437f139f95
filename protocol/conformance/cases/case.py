"""A case: one test of a table against one clause."""

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
        clause: the clause that the case tests.
        how: what the case does, in one sentence.
        needs: the capabilities without which it is skipped.
        travel_deg: how far a conforming table turns in each direction from the start of the session.
        run: runs the case; raises `NonconformityError`.
    """

    id: str
    clause: Clause
    how: str
    needs: frozenset[str]
    travel_deg: float
    run: Run


CASES: dict[str, Case] = {}
"""Every registered case by its id. A case is registered when its file is imported; `catalog` has all cases."""


def case(identifier: str, *needs: str, travel_deg: float = 0.0) -> Callable[[Run], Run]:
    """Register a function as a case of a clause. Its docstring describes the procedure."""

    def register(run: Run) -> Run:
        assert identifier not in CASES, identifier
        clause = specification()[identifier.partition(":")[0]]
        how = " ".join((run.__doc__ or "").split())
        CASES[identifier] = Case(identifier, clause, how, frozenset(needs), travel_deg, run)
        return run

    return register
