"""The joints of the arm at the nodes of a lattice, and what it can follow of a step: moves and arrivals.

A move changes the turns of the joints (`joint_turns`). For neighboring nodes, most moves change them in the same way:
these are one run.
"""

from typing import NamedTuple

import numpy as np

from planner.arrays import FloatArray, IndexArray
from planner.kernel import kernel
from planner.plans.arm_on_path import ArmOnPath
from planner.reasons import Reason
from planner.search.joint_turns import JOINTS, Turns, fitting, turn_change
from planner.search.lattice import ANY_COST, Lattice, StepRows, margin


class Runs(NamedTuple):
    """Neighboring moves with the same change of turns.

    Attributes:
        first: (n_runs,) index of the first node.
        last: (n_runs,) index after the last node.
        change: (n_runs,) code of the change.
        begins: (n_shifts * 2 + 1,) index of the first run of each shift and parity.
    """

    first: IndexArray
    last: IndexArray
    change: IndexArray
    begins: IndexArray


def node_joints(on_path: ArmOnPath, lattice: Lattice) -> FloatArray:
    """Return the joints at the nodes, in radians, NaN where the arm has no pose: (n + 1, 2, places, 6).

    Node p of a column is in row p & 1 at index (p >> 1) - lattice.first_q + `reach`.
    """
    places = np.arange(-reach(lattice), lattice.q_count + reach(lattice))
    # A node that is reached again after a turn must have the same turn of the joints: it is solved once.
    solved = np.arange(lattice.q_count) if lattice.is_closed else places
    offsets_deg = ((2 * (lattice.first_q + solved) + np.array([[0], [1]])) * lattice.node_deg).ravel()
    result = np.empty((len(lattice.reference.angles_deg), 2, len(places), JOINTS))
    for k, angle_deg in enumerate(lattice.reference.angles_deg.tolist()):
        joints, reasons = on_path.solve(np.full(len(offsets_deg), k), angle_deg + offsets_deg)
        joints[reasons != Reason.REACHED] = np.nan
        result[k] = joints.reshape(2, -1, JOINTS)[:, places % len(solved) if lattice.is_closed else slice(None)]
    return result


@kernel
def reach(lattice: Lattice) -> int:
    """Return the number of entries of joints before `first`, and after the last q: as far as the end of a step."""
    return 2 * lattice.half_count + 2


@kernel
def gather_runs(lattice: Lattice, turns: Turns, before: FloatArray, after: FloatArray) -> Runs:
    """Return the moves of a step that no joint speed bars, from joints (2, places, 6) to joints.

    The moves by `shift` nodes from nodes of a parity start at `begins[2 * (shift + 2 * half_count) + parity]`.
    """
    most, places = 2 * lattice.half_count, before.shape[1]
    first, last = np.empty((4 * most + 2) * places, dtype=np.int64), np.empty((4 * most + 2) * places, dtype=np.int64)
    change, begins = np.empty_like(first), np.zeros(4 * most + 3, dtype=np.int64)
    number = 0
    for shift in range(-most, most + 1):
        for parity in range(2):
            ahead, code = (parity + shift) >> 1, -1
            for place in range(max(0, -ahead), min(places, places - ahead)):
                now = turn_change(turns, before[parity, place], after[(parity + shift) & 1, place + ahead])
                if now >= 0 and now != code:
                    first[number], change[number] = place, now
                    number += 1
                if now >= 0:
                    last[number - 1] = place + 1
                code = now
            begins[2 * (shift + most) + parity + 1] = number
    return Runs(first[:number], last[:number], change[:number], begins)


@kernel
def arrival_costs(lattice: Lattice, turns: Turns, joints: FloatArray, rows: StepRows) -> FloatArray:
    """Return the cost of arriving at the nodes of a column on each of the turns: (n_turns, 2, places of rows)."""
    costs = np.full((len(turns.turns), *rows.value_cost.shape), np.inf)
    ahead = reach(lattice) - margin(lattice)
    for parity in range(2):
        fits = fitting(turns, joints[parity])
        for c in range(len(turns.turns)):
            for place in range(costs.shape[2]):
                if fits[c, place + ahead] and rows.value_cost[parity, place] < ANY_COST:
                    costs[c, parity, place] = rows.value_cost[parity, place]
    return costs
