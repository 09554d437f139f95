"""The fewest strips that see enough, by a solver that proves it: the reference of `planner.adaptive.choice`."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from ortools.sat.python import cp_model

from planner.arrays import BoolArray


class Fewest(NamedTuple):
    """How many strips are needed.

    Attributes:
        strips: Found to be enough.
        at_least: Proved to be needed.
    """

    strips: int
    at_least: int


def fewest_strips(sees: BoolArray, wanted: int, known: Sequence[int] = (), limit_s: float = 60.0) -> Fewest:
    """Return the fewest of strips `(n, m)` that together see at least `wanted` of the places.

    Args:
        sees: Which strip sees which place.
        wanted: How many places are to be seen.
        known: Strips that are known to be enough, from which the solver starts.
        limit_s: How long it may search.
    """
    # Places that the same strips see are one place that counts for several.
    kinds, counts = np.unique(sees, axis=1, return_counts=True)
    model = cp_model.CpModel()
    taken = [model.new_bool_var(f"strip {i}") for i in range(len(sees))]
    covered = [model.new_bool_var(f"place {j}") for j in range(len(counts))]
    for j, each in enumerate(covered):
        model.add_bool_or([taken[i] for i in np.flatnonzero(kinds[:, j])] + [~each])
    model.add(cp_model.LinearExpr.weighted_sum(covered, counts.tolist()) >= wanted)
    model.minimize(cp_model.LinearExpr.sum(taken))
    for i, each in enumerate(taken if known else []):
        model.add_hint(each, i in known)
    solver = cp_model.CpSolver()
    solver.parameters.num_workers = 1
    solver.parameters.max_time_in_seconds = limit_s
    if solver.solve(model) not in {cp_model.OPTIMAL, cp_model.FEASIBLE}:
        raise ValueError(f"no {wanted} places can be seen")
    return Fewest(round(solver.objective_value), int(np.ceil(solver.best_objective_bound - 1e-6)))
