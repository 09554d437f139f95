"""The paper's reference: the shortest path in an explicit graph, with scipy.

Eq. (8) rounds each state to a cell. Off an exact lattice, a rounded path is not a motion: if it is executed, it drifts
into forbidden regions. So the cells here are the nodes of a lattice on which every step ends exactly on a node. The
path in the graph is the motion, and the optimum of that lattice.
"""

from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from scipy.sparse import csr_array
from scipy.sparse.csgraph import dijkstra as shortest_paths

from planner.arrays import FloatArray, IndexArray
from planner.defaults import DIJKSTRA
from planner.kernel import kernel
from planner.map.config_map import column_value, wrapped
from planner.plans.crossing import step_is_allowed
from planner.plans.plan import Infeasibility, NoPlan, Outcome, make_plan, obvious_infeasibility
from planner.plans.problem import Problem, Terms
from planner.search.lattice import Lattice, motion_along, speed_unit
from planner.search.lattice_choice import turn_lattice
from planner.search.lattice_cost_to_go import steps_from
from planner.table.cost import acceleration_cost, speed_cost, value_cost
from planner.table.motion import Motion

# Speeds in each direction, from the preferred to the minimum number; scipy needs 40 bytes per edge.
SPEED_COUNTS = (10, 7, 5, 3, 2, 1)
MOST_EDGES = 15_000_000


class ShortestPath(NamedTuple):
    """The shortest path in the graph.

    Attributes:
        motion: the path.
        cost: its length in the graph: Eq. (7).
    """

    motion: Motion
    cost: float


class Edges(NamedTuple):
    """The edges of all nodes in order; a node is (column, speed, q), with q as the fastest index.

    Attributes:
        lengths: cost of each edge, plus an offset.
        targets: target node of each edge.
        ends: (n_nodes,) end of the edges of each node.
    """

    lengths: FloatArray
    targets: npt.NDArray[np.int32]
    ends: IndexArray


def dijkstra(problem: Problem, lattice: Lattice | None = None) -> Outcome:
    """Return the shortest path in the graph of a lattice.

    By default, it is the finest of a few lattices that fit into memory.
    """
    no_plan = obvious_infeasibility(problem, DIJKSTRA)
    if no_plan is not None:
        return no_plan
    lattice = lattice or _lattice_that_fits(problem)
    path = None if lattice is None else shortest_path(problem, lattice)
    return NoPlan(DIJKSTRA, Infeasibility.NOT_FOUND) if path is None else make_plan(problem, DIJKSTRA, *path.motion)


def _lattice_that_fits(problem: Problem) -> Lattice | None:
    lattices = (turn_lattice(problem, count, MOST_EDGES // problem.step_count) for count in SPEED_COUNTS)
    return next((lattice for lattice in lattices if lattice is not None), None)


def shortest_path(problem: Problem, lattice: Lattice) -> ShortestPath | None:
    """Return the shortest path in the graph of a lattice around the turn; None if there is none."""
    # The library treats an edge of length 0 as missing. All paths have n edges, so an offset changes nothing.
    offset = problem.greatest_step_cost
    edges = _edges(problem.terms, lattice, offset)
    graph = _graph_with_source(edges, _start_nodes(problem, lattice))
    source = [graph.shape[0] - 1]
    (distances,), (predecessors,) = shortest_paths(graph, indices=source, return_predecessors=True)
    layer = (2 * lattice.half_count + 1) * lattice.q_count
    end = layer * problem.step_count + int(np.argmin(distances[layer * problem.step_count : -1]))
    if not np.isfinite(distances[end]):
        return None
    nodes = [end]
    while nodes[-1] >= layer:
        nodes.append(int(predecessors[nodes[-1]]))
    path = np.array(nodes[::-1]) % layer
    speeds = path // lattice.q_count - lattice.half_count
    motion = motion_along(lattice, int(path[0] % lattice.q_count), speeds, problem.step_s)
    return ShortestPath(motion, float(distances[end] - 1.0 - offset * problem.step_count))


def _start_nodes(problem: Problem, lattice: Lattice) -> IndexArray:
    """Return the nodes of column 0 that a path may start from."""
    speeds = np.arange(-lattice.half_count, lattice.half_count + 1)
    i, q = np.meshgrid(speeds, np.arange(lattice.q_count), indexing="ij")
    is_start = np.ones(i.shape, dtype=np.bool_)
    if problem.start_speed_deg_s is not None:
        is_start &= i == 0
    if problem.start_angle_deg is not None:
        is_start &= (2 * q + i) % (2 * lattice.q_count) == 0
    return np.flatnonzero(is_start)


def _graph_with_source(edges: Edges, sources: IndexArray) -> csr_array:
    """Return the graph with one more node, the last, which has an edge of length 1 to each start."""
    count = len(edges.ends)
    data = np.concatenate((edges.lengths, np.ones(len(sources))))
    indices = np.concatenate((edges.targets, sources.astype(np.int32)))
    pointers = np.concatenate(([0], edges.ends, [len(data)]))
    return csr_array((data, indices, pointers), shape=(count + 1, count + 1))


@kernel
def _edges(terms: Terms, lattice: Lattice, offset: float) -> Edges:
    """Return the edges: the steps of the lattice that the crossing rule allows."""
    steps, half, count = len(terms.values) - 1, lattice.half_count, lattice.q_count
    speeds = 2 * half + 1
    unit, reference = speed_unit(lattice, terms.step_s), lattice.reference
    capacity = 0
    for k in range(steps):
        for i in range(-half, half + 1):
            first, last = steps_from(terms, lattice, k, i)
            capacity += max(0, last - first + 1) * count
    lengths, targets = np.empty(capacity), np.empty(capacity, dtype=np.int32)
    ends = np.empty((steps + 1) * speeds * count, dtype=np.int64)
    found = 0
    for node in range(len(ends)):
        k, i, q = node // (speeds * count), node // count % speeds - half, node % count
        first, last = steps_from(terms, lattice, k, i) if k < steps else (1, 0)
        for j in range(first, last + 1):
            angle = reference.angles_deg[k] + (2 * q + i) * lattice.node_deg
            acceleration = reference.accelerations_deg_s2[k] + (j - i) * unit / terms.step_s
            speed = reference.speeds_deg_s[k] + i * unit
            if not step_is_allowed(terms.runs, k, angle, speed, acceleration, terms.step_s):
                continue
            end = reference.angles_deg[k + 1] + (2 * (q + i) + j) * lattice.node_deg
            lengths[found] = offset + acceleration_cost(terms.acceleration_weight, acceleration)
            lengths[found] += speed_cost(terms.speed_weight, reference.speeds_deg_s[k + 1] + j * unit)
            lengths[found] += value_cost(column_value(terms.values, terms.epsilon, k + 1, end))
            targets[found] = ((k + 1) * speeds + j + half) * count + wrapped(q + i, count)
            found += 1
        ends[node] = found
    return Edges(lengths[:found], targets[:found], ends)
