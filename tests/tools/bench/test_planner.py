import pytest

from planner.map.synthetic_maps import MapFamily, synthetic_map
from planner.planning.dijkstra import Cells, lattice_path
from planner.planning.plan import Plan
from planner.planning.problem import Problem
from planner.table.motion import Limits
from tools.bench.planner import lattice_optimum, median_seconds


def test_what_plans_are_measured_against_is_the_optimum_of_scipys_graph() -> None:
    # 90 angles and 1 s: speeds of multiples of 2 deg/s end each step on a node 1 deg apart.
    problem = Problem(synthetic_map(MapFamily(0.2, 3.0, location_count=8, angle_count=90), 1), 1.0, Limits(40.0, 10.0))
    optimum = lattice_optimum(problem)
    shortest = lattice_path(problem, Cells(angle_count=360, speed_count=41, acceleration_count=11))
    assert isinstance(optimum, Plan)
    assert shortest is not None
    assert optimum.cost.total == pytest.approx(shortest.cost, rel=1e-3)


def test_a_time_is_measured_after_compiling() -> None:
    calls = []
    assert median_seconds(lambda: calls.append(1), repeats=4) >= 0.0
    assert len(calls) == 5
