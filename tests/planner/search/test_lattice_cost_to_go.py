import numpy as np
import pytest

from planner.map.config_map import ConfigurationMap
from planner.plans.problem import Problem
from planner.search.lattice import Lattice, speed_unit
from planner.search.lattice_cost_to_go import steps_from
from planner.table.motion import Limits, Motion


@pytest.mark.parametrize("node_deg", [0.7, 0.25])
def test_the_steps_from_a_speed_are_those_within_both_limits(node_deg: float) -> None:
    problem = Problem(ConfigurationMap(np.ones((2, 36))), 0.5, Limits(20.0, 30.0))
    reference = Motion(np.array([0.0, 1.25]), np.array([3.0, 2.0]), np.array([-2.0]))
    lattice = Lattice(reference, node_deg, 20, 0, 72, is_closed=True)
    unit, speeds = speed_unit(lattice, 0.5), range(-20, 21)
    for i in speeds:
        now = 3.0 + i * unit
        allowed = [j for j in speeds if abs(2.0 + j * unit) <= 20.0 and abs(2.0 + j * unit - now) <= 15.0]
        first, last = steps_from(problem.terms, lattice, 0, i)
        assert list(range(first, last + 1)) == (allowed if abs(now) <= 20.0 else [])
