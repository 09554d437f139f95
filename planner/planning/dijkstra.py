"""The paper's reference: the shortest path in the explicit graph of Eq. (8).

States are snapped to the cells (angle i, column j, speed k) of a grid after every step. On a grid where every step
ends exactly on a node this is the true optimum; elsewhere the snapped motion is not what the table does, so the plan
that is returned is its accelerations carried out with Eq. (3) and (4), which may drift into a forbidden region.
"""

from itertools import pairwise
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from scipy.sparse import csr_array
from scipy.sparse.csgraph import dijkstra as shortest_paths

from planner.arrays import FloatArray, IndexArray
from planner.kernel import kernel
from planner.map.config_map import column_value
from planner.planning.crossing import step_is_allowed
from planner.planning.plan import Infeasibility, NoPlan, Outcome, make_plan, obvious_infeasibility
from planner.planning.problem import Problem, Terms
from planner.table.cost import acceleration_cost, speed_cost, value_cost
from planner.table.motion import next_angle, next_speed, roll_out

NAME = "dijkstra"


class Cells(NamedTuple):
    """The discretisation of Eq. (8).

    Attributes:
        angle_count: cells over one turn, centred on multiples of 360 / angle_count degrees.
        speed_count: cells of speed, odd; the outermost are centred on the limits.
        acceleration_count: accelerations per node, evenly spaced between the limits, odd.
    """

    angle_count: int = 100
    speed_count: int = 41
    acceleration_count: int = 21


class LatticePath(NamedTuple):
    """The optimum of the discrete problem, as the cells see it.

    Attributes:
        angles_deg: (n + 1,) unwrapped centres of the cells passed.
        speeds_deg_s: (n + 1,) their speeds.
        accelerations_deg_s2: (n,) accelerations that lead from each to the next, before snapping.
        cost: Eq. (7) along the graph.
    """

    angles_deg: FloatArray
    speeds_deg_s: FloatArray
    accelerations_deg_s2: FloatArray
    cost: float


def dijkstra(problem: Problem, cells: Cells | None = None) -> Outcome:
    """Return the accelerations of the shortest path in the graph, carried out with exact kinematics."""
    no_plan = obvious_infeasibility(problem, NAME)
    if no_plan is not None:
        return no_plan
    path = lattice_path(problem, cells or Cells())
    if path is None:
        return NoPlan(NAME, Infeasibility.UNREACHABLE)
    start_deg = path.angles_deg[0] if problem.start_angle_deg is None else problem.start_angle_deg
    start_speed = path.speeds_deg_s[0] if problem.start_speed_deg_s is None else problem.start_speed_deg_s
    angles, speeds = roll_out(float(start_deg), float(start_speed), path.accelerations_deg_s2, problem.step_s)
    return make_plan(problem, NAME, angles, speeds, path.accelerations_deg_s2)


def lattice_path(problem: Problem, cells: Cells) -> LatticePath | None:
    """Return the shortest path in the graph of Eq. (8); None where there is none."""
    accelerations = np.linspace(-1.0, 1.0, cells.acceleration_count) * problem.limits.acceleration_deg_s2
    costs, targets, used, row_ends = _edges(problem.terms, cells, accelerations, _offset(problem))
    sources = _start_nodes(problem, cells)
    graph = _graph_with_source(costs, targets, row_ends, sources)
    source = [graph.shape[0] - 1]
    (distances,), (predecessors,) = shortest_paths(graph, indices=source, return_predecessors=True)
    layer = cells.angle_count * cells.speed_count
    end = layer * problem.step_count + int(np.argmin(distances[layer * problem.step_count : -1]))
    if not np.isfinite(distances[end]):
        return None
    nodes = [end]
    while nodes[-1] >= layer:
        nodes.append(int(predecessors[nodes[-1]]))
    path = np.array(nodes[::-1])
    edges = [_edge(costs, targets, row_ends, a, b) for a, b in pairwise(path)]
    speeds = (path % layer // cells.angle_count - cells.speed_count // 2) * _speed_step(problem, cells)
    wrapped_deg = (path % cells.angle_count) * (360.0 / cells.angle_count)
    chosen = accelerations[used[edges]]
    angles = wrapped_deg.copy()
    for k, acceleration in enumerate(chosen):
        unsnapped_deg = next_angle(float(angles[k]), float(speeds[k]), float(acceleration), problem.step_s)
        angles[k + 1] += 360.0 * round((unsnapped_deg - angles[k + 1]) / 360.0)
    return LatticePath(angles, speeds, chosen, float((costs[edges] - _offset(problem)).sum()))


def _speed_step(problem: Problem, cells: Cells) -> float:
    return 2.0 * problem.limits.speed_deg_s / (cells.speed_count - 1)


def _offset(problem: Problem) -> float:
    """Return what is added to each edge: the library takes an edge of cost 0 for none. All paths have n edges."""
    return problem.greatest_step_cost


def _start_nodes(problem: Problem, cells: Cells) -> IndexArray:
    """Return the nodes of column 0 that a path may start from."""
    step_deg = 360.0 / cells.angle_count
    angles = np.arange(cells.angle_count)
    if problem.start_angle_deg is not None:
        angles = np.array([int(np.floor(problem.start_angle_deg / step_deg + 0.5)) % cells.angle_count])
    angles = angles[[problem.map.is_allowed(0, float(i * step_deg)) for i in angles]]
    speeds = np.arange(cells.speed_count)
    if problem.start_speed_deg_s is not None:
        index = np.floor(problem.start_speed_deg_s / _speed_step(problem, cells) + 0.5)
        speeds = np.array([int(index) + cells.speed_count // 2])
    return (speeds[:, None] * cells.angle_count + angles[None, :]).ravel()


def _graph_with_source(
    costs: FloatArray, targets: npt.NDArray[np.int32], row_ends: IndexArray, sources: IndexArray
) -> csr_array:
    """Return the graph with one more node, the last, from which all starts are one edge of cost 1 away."""
    count = len(row_ends)
    data = np.concatenate((costs, np.ones(len(sources))))
    indices = np.concatenate((targets, sources.astype(np.int32)))
    pointers = np.concatenate(([0], row_ends, [len(data)]))
    return csr_array((data, indices, pointers), shape=(count + 1, count + 1))


def _edge(costs: FloatArray, targets: npt.NDArray[np.int32], row_ends: IndexArray, source: int, target: int) -> int:
    """Return the cheapest edge between two nodes."""
    first, last = (0 if source == 0 else int(row_ends[source - 1])), int(row_ends[source])
    parallel = first + np.flatnonzero(targets[first:last] == target)
    return int(parallel[np.argmin(costs[parallel])])


@kernel
def _edges(
    terms: Terms, cells: Cells, accelerations: FloatArray, offset: float
) -> tuple[FloatArray, npt.NDArray[np.int32], npt.NDArray[np.int8], IndexArray]:
    """Return the edges of all nodes in turn: cost, target, index of the acceleration; and where each node's end."""
    steps, layer = len(terms.values) - 1, cells.angle_count * cells.speed_count
    step_deg = 360.0 / cells.angle_count
    half, speed_step = cells.speed_count // 2, 2.0 * terms.speed_limit_deg_s / (cells.speed_count - 1)
    capacity = steps * layer * len(accelerations)
    costs, targets = np.empty(capacity), np.empty(capacity, dtype=np.int32)
    used, row_ends = np.empty(capacity, dtype=np.int8), np.empty((steps + 1) * layer, dtype=np.int64)
    count = 0
    for node in range((steps + 1) * layer):
        k, j, i = node // layer, node % layer // cells.angle_count, node % cells.angle_count
        if k < steps and column_value(terms.values, terms.epsilon, k, i * step_deg) > terms.epsilon:
            for a in range(len(accelerations)):
                speed = next_speed((j - half) * speed_step, accelerations[a], terms.step_s)
                angle = next_angle(i * step_deg, (j - half) * speed_step, accelerations[a], terms.step_s)
                speed_cell = int(np.floor(speed / speed_step + 0.5)) + half
                angle_cell = int(np.floor(angle / step_deg + 0.5 + 1e-9)) % cells.angle_count
                value = column_value(terms.values, terms.epsilon, k + 1, angle_cell * step_deg)
                if not 0 <= speed_cell < cells.speed_count or value <= terms.epsilon:
                    continue
                if not step_is_allowed(
                    terms.runs, k, i * step_deg, (j - half) * speed_step, accelerations[a], terms.step_s
                ):
                    continue
                costs[count] = offset + acceleration_cost(terms.acceleration_weight, accelerations[a])
                costs[count] += speed_cost(terms.speed_weight, speed) + value_cost(value)
                targets[count] = (k + 1) * layer + speed_cell * cells.angle_count + angle_cell
                used[count] = a
                count += 1
        row_ends[node] = count
    return costs[:count], targets[:count], used[:count], row_ends
