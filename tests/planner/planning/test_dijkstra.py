import math

import numpy as np
import pytest

from planner.map.config_map import ConfigurationMap
from planner.map.synthetic_maps import MapFamily, synthetic_map
from planner.planning.dijkstra import Cells, dijkstra, lattice_path
from planner.planning.dynamic_programming import dynamic_programming
from planner.planning.plan import Infeasibility, NoPlan, Plan
from planner.planning.problem import Problem
from planner.table.motion import Limits
from tests.planner.exhaustive_search import is_forbidden_on_the_way, least_cost

LATTICE = Cells(angle_count=18, speed_count=3, acceleration_count=3)


@pytest.mark.parametrize("seed", range(6))
def test_on_a_lattice_the_shortest_path_is_what_trying_every_motion_finds(seed: int) -> None:
    configuration_map = synthetic_map(MapFamily(0.25, 1.2, location_count=5, angle_count=18), seed)
    start_deg = 20.0 * int(np.argmax(configuration_map.values[0]))
    problem = Problem(configuration_map, step_s=1.0, limits=Limits(40.0, 40.0), start_angle_deg=start_deg)
    optimum = least_cost(problem, [-40.0, 0.0, 40.0])
    outcome = dijkstra(problem, LATTICE)
    if math.isinf(optimum):
        assert isinstance(outcome, NoPlan)
    else:
        assert isinstance(outcome, Plan)
        assert outcome.cost.total == pytest.approx(optimum)
        assert not is_forbidden_on_the_way(problem.map, outcome)


def test_cells_are_centred_and_half_open_as_in_equation_8() -> None:
    problem = Problem(ConfigurationMap(np.ones((3, 8))), start_angle_deg=22.5 - 1e-6)
    path = lattice_path(problem, Cells(8, 41, 21))
    assert path is not None
    assert path.angles_deg[0] == 0.0
    path = lattice_path(Problem(ConfigurationMap(np.ones((3, 8))), start_angle_deg=22.5), Cells(8, 41, 21))
    assert path is not None
    assert path.angles_deg[0] == 45.0


def test_off_a_lattice_the_snapped_path_is_not_what_the_table_does() -> None:
    # The reason why dynamic programming, which does not snap, is the planner of record.
    drifts, violations = [], 0
    for seed in range(6):
        family = MapFamily(0.35, 3.0, 0.3, location_count=40, angle_count=60)
        problem = Problem(synthetic_map(family, seed), step_s=0.25)
        path, executed, planned = (
            lattice_path(problem, Cells(60, 21, 11)),
            dijkstra(problem, Cells(60, 21, 11)),
            dynamic_programming(problem),
        )
        if path is not None and isinstance(executed, Plan) and isinstance(planned, Plan):
            drifts.append(np.abs(executed.angles_deg - path.angles_deg).max())
            violations += is_forbidden_on_the_way(problem.map, executed)
            assert not is_forbidden_on_the_way(problem.map, planned)
    assert max(drifts) > problem.map.angle_step_deg
    assert violations > 0


def test_where_the_graph_has_no_path_there_is_no_plan() -> None:
    values = np.zeros((3, 12))
    values[0, 0] = values[1, 5] = values[2, 5] = 1.0
    outcome = dijkstra(Problem(ConfigurationMap(values)))
    assert isinstance(outcome, NoPlan)
    assert outcome.infeasibility is Infeasibility.UNREACHABLE


def test_a_path_may_wind_around_the_turn() -> None:
    values = np.zeros((60, 36))
    for k in range(60):
        values[k, [(k + offset) % 36 for offset in range(-2, 3)]] = 1.0
    problem = Problem(ConfigurationMap(values), step_s=0.5, start_speed_deg_s=None)
    path = lattice_path(problem, Cells(36, 41, 21))
    assert path is not None
    assert path.angles_deg[-1] - path.angles_deg[0] == pytest.approx(590.0, abs=40.0)
