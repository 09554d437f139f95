"""A lattice of angles and speeds around a reference motion, on which every step ends exactly on a node.

Under Eq. (3) and (4) a motion is its reference plus another motion. Count angles from the reference in nodes of h
degrees, and speeds from it in units of 2 h / dt. A step from speed i to speed j then leads from node p to node
p + i + j: nothing is interpolated, and a path of the lattice *is* a motion.

The parity of p + i never changes. So only the nodes p = 2 q + i are kept, and a step leads from q to q + i, whatever
speed it ends with. Standing still, the table is on every second node: with an even number of nodes a sample of the map
that can be any sample.
"""

from typing import NamedTuple

import numpy as np

from planner.arrays import CostArray, FloatArray
from planner.kernel import kernel
from planner.map.config_map import SAMPLE_TOLERANCE, column_value, sample_at_or_above, sample_at_or_below, wrapped
from planner.planning.problem import Terms
from planner.table.cost import value_cost
from planner.table.motion import Motion

# Half of the tolerance within which an angle lies on a sample: the other half is left to rounding.
ON_A_SAMPLE = 0.5 * SAMPLE_TOLERANCE

# Infinity that survives additions in single precision; ANY_COST is far above what a path can cost, in units of the
# greatest cost of a step.
UNREACHABLE = np.float32(1e30)
ANY_COST = np.float32(1e12)

# Fewer nodes than any step moves.
NO_ROOM = np.float32(-1e9)


class Lattice(NamedTuple):
    """States (column, speed i, q) around a reference motion.

    Attributes:
        reference: what angles and speeds are counted from. It need not avoid forbidden regions.
        node_deg: h, the distance of two nodes.
        half_count: i runs from -half_count to half_count.
        first: the first q.
        count: how many q there are.
        is_closed: whether q goes around the turn, in `count` steps; if not, the lattice is a tube around the reference.
    """

    reference: Motion
    node_deg: float
    half_count: int
    first: int
    count: int
    is_closed: bool


class StepRows(NamedTuple):
    """What is known of each node p before the step from column k to the next.

    The nodes are in two rows, even and odd, so that p = 2 q + i is found in row i & 1 at place
    q + (i >> 1) - lattice.first + margin, and neighbouring q are neighbours in memory.

    Attributes:
        room_above: greatest change i + j of a step that stays allowed upwards; far below any where p is forbidden.
        room_below: greatest -(i + j), downwards.
        turn_above: how far above p the table may turn back, in nodes.
        turn_below: how far below.
        value_cost: first term of Eq. (6) in units, at p as a node of column k + 1.
    """

    room_above: CostArray
    room_below: CostArray
    turn_above: FloatArray
    turn_below: FloatArray
    value_cost: CostArray


@kernel
def speed_unit(lattice: Lattice, step_s: float) -> float:
    """Return the distance of two speeds in deg/s."""
    return 2.0 * lattice.node_deg / step_s


@kernel
def cost_unit(terms: Terms) -> float:
    """Return the greatest cost of a step: costs are counted in it, so that any weights fit into single precision."""
    return 0.5 * terms.pause_cost


@kernel
def margin(lattice: Lattice) -> int:
    """Return how many places a row has before `first`, and after the last q: as far as a step leads."""
    return lattice.half_count + 1


@kernel
def make_rows(lattice: Lattice) -> StepRows:
    """Return room for what `lay_out_step` writes."""
    shape = (2, lattice.count + 2 * margin(lattice))
    return StepRows(
        np.empty(shape, dtype=np.float32),
        np.empty(shape, dtype=np.float32),
        np.empty(shape),
        np.empty(shape),
        np.empty(shape, dtype=np.float32),
    )


@kernel
def lay_out_step(terms: Terms, lattice: Lattice, column: int, rows: StepRows) -> None:
    """Write what the step from `column` to the next needs to know of its nodes."""
    run_start, run_end = runs_of_step(terms, column)
    angles_deg, samples_per_deg = lattice.reference.angles_deg, terms.values.shape[1] / 360.0
    nodes_per_sample = 1.0 / (samples_per_deg * lattice.node_deg)
    moved = (angles_deg[column + 1] - angles_deg[column]) / lattice.node_deg
    unit = cost_unit(terms)
    for parity in range(2):
        for place in range(rows.value_cost.shape[1]):
            offset_deg = (2 * (place + lattice.first - margin(lattice)) + parity) * lattice.node_deg
            position = (angles_deg[column] + offset_deg) * samples_per_deg
            above, below = _room(run_start, run_end, position)
            above, below = above * nodes_per_sample, below * nodes_per_sample
            rows.turn_above[parity, place], rows.turn_below[parity, place] = above, below
            rows.room_above[parity, place] = np.floor(above - moved) if above >= 0.0 else NO_ROOM
            rows.room_below[parity, place] = np.floor(below + moved) if above >= 0.0 else NO_ROOM
            value = column_value(terms.values, terms.epsilon, column + 1, angles_deg[column + 1] + offset_deg)
            rows.value_cost[parity, place] = value_cost(value) / unit if value > terms.epsilon else UNREACHABLE


@kernel
def runs_of_step(terms: Terms, column: int) -> tuple[FloatArray, FloatArray]:
    """Return, per sample, how far the samples allowed in `column` and the next reach, downwards and upwards.

    In samples; -1 where the sample is forbidden, far more than a turn where the whole turn is allowed.
    """
    runs = terms.runs[column]
    count = len(runs)
    downwards, upwards = np.empty(count), np.empty(count)
    length = 0
    for i in range(-count, count):
        length = length + 1 if runs[i] > 0 else 0
        if i >= 0:
            whole = runs[i] > count
            upwards[i] = 1e9 if whole else runs[i] - 1.0
            downwards[i] = 1e9 if whole else length - 1.0
    return downwards, upwards


@kernel
def _room(downwards: FloatArray, upwards: FloatArray, position: float) -> tuple[float, float]:
    """Return by how many samples one may move up and down from a position (in samples); -1 where it is forbidden.

    Both lengths are rounded up by what still lies on a sample.
    """
    below, above = sample_at_or_below(position), sample_at_or_above(position)
    index = wrapped(below, len(upwards))
    if upwards[index] < above - below:
        return -1.0, -1.0
    return (
        below + upwards[index] - position + ON_A_SAMPLE,
        position - below + downwards[index] + ON_A_SAMPLE,
    )
