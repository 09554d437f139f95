"""A lattice of angles and speeds around a reference motion, on which every step ends exactly on a node.

Under Eq. (3) and (4) a motion is its reference plus another motion. Count angles from the reference in nodes of h
degrees, and speeds from it in units of 2 h / dt. A step from speed i to speed j then moves from node p to node p + i +
j: nothing is interpolated, and a path of the lattice *is* a motion.

The parity of p + i never changes. So only the nodes p = 2 q + i are stored. A step moves from q to q + i for any final
speed. At rest, the table is on every second node: with an even number of nodes per sample of the map, it can be on any
sample.
"""

from typing import NamedTuple

import numpy as np

from planner.arrays import CostArray, FloatArray, IndexArray
from planner.kernel import kernel
from planner.map.config_map import SAMPLE_TOLERANCE, sample_at_or_below, wrapped
from planner.plans.problem import Terms
from planner.table.cost import value_cost
from planner.table.motion import Motion

# Half of the tolerance within which an angle is on a sample: the other half is for rounding.
ON_A_SAMPLE = 0.5 * SAMPLE_TOLERANCE

# Infinity that keeps its effect in additions in single precision; ANY_COST is far above any possible cost of a path, in
# units of the maximum cost of a step.
UNREACHABLE = np.float32(1e30)
ANY_COST = np.float32(1e12)

# Fewer nodes than any step moves.
NO_ROOM = np.float32(-1e9)


class Lattice(NamedTuple):
    """States (column, speed i, q) around a reference motion.

    Attributes:
        reference: origin of angles and speeds. It may cross forbidden regions.
        node_deg: h, the distance of two nodes.
        half_count: i runs from -half_count to half_count.
        first_q: the first q.
        q_count: number of values of q.
        is_closed: whether q covers the turn in `q_count` steps; if not, the lattice is a tube around the reference.
    """

    reference: Motion
    node_deg: float
    half_count: int
    first_q: int
    q_count: int
    is_closed: bool


class StepRows(NamedTuple):
    """Data of each node p before the step from column k to the next.

    The nodes are in two rows, even and odd. So p = 2 q + i is in row i & 1 at index q + (i >> 1) - lattice.first_q +
    margin, and neighboring q are neighbors in memory.

    Attributes:
        room_above: maximum change i + j of a step that is allowed upward; far below any possible value if p is
            forbidden.
        room_below: maximum of -(i + j), downward.
        turn_above: maximum distance above p at which the table may reverse, in nodes.
        turn_below: the same below.
        value_cost: first term of Eq. (6) in units, at p as a node of column k + 1.
        sample: the sample at or below p.
        fraction: distance of p above it, in samples; 0 on it.
    """

    room_above: CostArray
    room_below: CostArray
    turn_above: CostArray
    turn_below: CostArray
    value_cost: CostArray
    sample: IndexArray
    fraction: FloatArray


@kernel
def speed_unit(lattice: Lattice, step_s: float) -> float:
    """Return the distance of two speeds in deg/s."""
    return 2.0 * lattice.node_deg / step_s


def motion_along(lattice: Lattice, q: int, speeds: IndexArray, step_s: float) -> Motion:
    """Return the motion of a path: it starts at q, and has speed i at each column."""
    qs = q + np.concatenate(([0], np.cumsum(speeds[:-1])))
    unit, reference = speed_unit(lattice, step_s), lattice.reference
    return Motion(
        reference.angles_deg + (2 * qs + speeds) * lattice.node_deg,
        reference.speeds_deg_s + speeds * unit,
        reference.accelerations_deg_s2 + np.diff(speeds) * unit / step_s,
    )


@kernel
def cost_unit(terms: Terms) -> float:
    """Return the maximum cost of a step, the unit of costs: so all weights fit into single precision."""
    return 0.5 * terms.pause_cost


@kernel
def margin(lattice: Lattice) -> int:
    """Return the number of entries of a row before `first`, and after the last q: as far as a step moves."""
    return lattice.half_count + 1


@kernel
def make_rows(lattice: Lattice) -> StepRows:
    """Return the work arrays that `lay_out_step` fills."""
    shape = (2, lattice.q_count + 2 * margin(lattice))
    return StepRows(
        np.empty(shape, dtype=np.float32),
        np.empty(shape, dtype=np.float32),
        np.empty(shape, dtype=np.float32),
        np.empty(shape, dtype=np.float32),
        np.empty(shape, dtype=np.float32),
        np.empty(shape, dtype=np.int64),
        np.empty(shape),
    )


@kernel
def lay_out_step(terms: Terms, lattice: Lattice, column: int, rows: StepRows) -> None:
    """Write the data of the nodes for the step from `column` to the next.

    Columns must be processed from the last to the first: the samples of the nodes are kept from one to the next.
    """
    angles_deg, samples_per_deg = lattice.reference.angles_deg, terms.values.shape[1] / 360.0
    nodes_per_sample = 1.0 / (samples_per_deg * lattice.node_deg)
    moved = (angles_deg[column + 1] - angles_deg[column]) / lattice.node_deg
    if column + 2 == len(angles_deg):
        _place_nodes(lattice, angles_deg[column + 1] * samples_per_deg, samples_per_deg, terms.values.shape[1], rows)
    _lay_out_values(terms, column + 1, rows)
    if moved != 0.0:
        _place_nodes(lattice, angles_deg[column] * samples_per_deg, samples_per_deg, terms.values.shape[1], rows)
    runs, runs_down = terms.runs[column], terms.runs_down[column]
    for parity in range(2):
        for place in range(rows.value_cost.shape[1]):
            sample, fraction = rows.sample[parity, place], rows.fraction[parity, place]
            is_allowed = runs[sample] > (1 if fraction > 0.0 else 0)
            above = (runs[sample] - 1.0 - fraction + ON_A_SAMPLE) * nodes_per_sample
            below = (runs_down[sample] - 1.0 + fraction + ON_A_SAMPLE) * nodes_per_sample
            rows.turn_above[parity, place] = -rounded_up(-above)
            rows.turn_below[parity, place] = -rounded_up(-below)
            rows.room_above[parity, place] = np.floor(above - moved) if is_allowed else NO_ROOM
            rows.room_below[parity, place] = np.floor(below + moved) if is_allowed else NO_ROOM


@kernel
def _place_nodes(lattice: Lattice, origin: float, samples_per_deg: float, sample_count: int, rows: StepRows) -> None:
    """Write the sample at or below each node, with the reference at `origin` (in samples)."""
    for parity in range(2):
        for place in range(rows.sample.shape[1]):
            node = 2 * (place + lattice.first_q - margin(lattice)) + parity
            position = origin + node * lattice.node_deg * samples_per_deg
            below = sample_at_or_below(position)
            fraction = position - below
            rows.sample[parity, place] = wrapped(below, sample_count)
            rows.fraction[parity, place] = fraction if fraction > SAMPLE_TOLERANCE else 0.0


@kernel
def _lay_out_values(terms: Terms, column: int, rows: StepRows) -> None:
    """Write the cost of the nodes in a column: the first term of Eq. (6), as in `column_value`."""
    values, unit, count = terms.values[column], cost_unit(terms), terms.values.shape[1]
    for parity in range(2):
        for place in range(rows.value_cost.shape[1]):
            sample, fraction = rows.sample[parity, place], rows.fraction[parity, place]
            lower, upper = values[sample], values[sample + 1 if sample + 1 < count else 0]
            is_allowed = lower > terms.epsilon and (fraction == 0.0 or upper > terms.epsilon)
            value = lower + fraction * (upper - lower)
            rows.value_cost[parity, place] = value_cost(value) / unit if is_allowed else UNREACHABLE


@kernel
def rounded_up(number: float) -> np.float32:
    """Return the smallest single-precision number that is not below a number."""
    single = np.float32(number)
    return single if float(single) >= number else np.nextafter(single, np.float32(np.inf))
