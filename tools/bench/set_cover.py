"""The fewest strips that see enough, by a solver that proves it: the reference of `planner.adaptive.choice`."""

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


def fewest_strips(sees: BoolArray, wanted: int, limit_s: float = 60.0, workers: int = 1) -> Fewest:
    """Return the fewest of strips `(n, m)` that together see at least `wanted` of the places."""
    model = cp_model.CpModel()
    taken = [model.new_bool_var(f"strip {i}") for i in range(len(sees))]
    covered = [model.new_bool_var(f"place {j}") for j in range(sees.shape[1])]
    for j, each in enumerate(covered):
        model.add_bool_or([taken[i] for i in np.flatnonzero(sees[:, j])] + [~each])
    model.add(sum(covered) >= wanted)
    model.minimize(sum(taken))
    solver = cp_model.CpSolver()
    solver.parameters.num_workers = workers
    solver.parameters.max_time_in_seconds = limit_s
    if solver.solve(model) not in {cp_model.OPTIMAL, cp_model.FEASIBLE}:
        raise ValueError(f"no {wanted} places can be seen")
    return Fewest(round(solver.objective_value), int(np.ceil(solver.best_objective_bound - 1e-6)))
