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

from planner.arrays import CostArray, FloatArray, IndexArray
from planner.kernel import kernel
from planner.map.config_map import SAMPLE_TOLERANCE, sample_at_or_below, wrapped
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
        first_q: the first q.
        q_count: how many q there are.
        is_closed: whether q goes around the turn in `q_count` steps; if not, this is a tube around the reference.
    """

    reference: Motion
    node_deg: float
    half_count: int
    first_q: int
    q_count: int
    is_closed: bool


class StepRows(NamedTuple):
    """What is known of each node p before the step from column k to the next.

    The nodes are in two rows, even and odd, so that p = 2 q + i is found in row i & 1 at place
    q + (i >> 1) - lattice.first_q + margin, and neighboring q are neighbors in memory.

    Attributes:
        room_above: greatest change i + j of a step that stays allowed upwards; far below any where p is forbidden.
        room_below: greatest -(i + j), downwards.
        turn_above: how far above p the table may turn back, in nodes.
        turn_below: how far below.
        value_cost: first term of Eq. (6) in units, at p as a node of column k + 1.
        sample: the sample at or below p.
        fraction: how far p lies above it, in samples; 0 on it.
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
    """Return the greatest cost of a step: costs are counted in it, so that any weights fit into single precision."""
    return 0.5 * terms.pause_cost


@kernel
def margin(lattice: Lattice) -> int:
    """Return how many places a row has before `first`, and after the last q: as far as a step leads."""
    return lattice.half_count + 1


@kernel
def make_rows(lattice: Lattice) -> StepRows:
    """Return room for what `lay_out_step` writes."""
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
    """Write what the step from `column` to the next needs to know of its nodes.

    Columns must come from the last to the first: the nodes' samples are kept from one to the next.
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
    """Write at or above which sample each node lies, when the reference lies at `origin` (in samples)."""
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
    """Write what the nodes cost in a column: the first term of Eq. (6), as `column_value` has it."""
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
    """Return the least number in single precision that is not below a number."""
    single = np.float32(number)
    return single if float(single) >= number else np.nextafter(single, np.float32(np.inf))
