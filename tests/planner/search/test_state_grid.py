import pytest

from planner.map.synthetic_maps import MapFamily, synthetic_map
from planner.plans.problem import Problem
from planner.search.state_grid import default_grid, ladder
from planner.table.motion import Limits


@pytest.mark.parametrize(("reach", "count"), [(1, 3), (4, 15), (10, 21), (50, 21), (200, 41)])
def test_a_ladder_of_jumps_is_symmetric_and_reaches_the_limit(reach: int, count: int) -> None:
    jumps = ladder(reach, count)
    assert jumps.tolist() == (-jumps[::-1]).tolist()
    assert 0 in jumps
    assert jumps.max() == reach
    assert len(jumps) <= count
    assert len(set(jumps.tolist())) == len(jumps)


@pytest.mark.parametrize("step_s", [0.01, 0.1, 1.0, 10.0])
@pytest.mark.parametrize("limits", [Limits(), Limits(1.0, 1000.0), Limits(100.0, 0.5)])
def test_a_default_grid_keeps_the_limits_and_uses_them(step_s: float, limits: Limits) -> None:
    problem = Problem(synthetic_map(MapFamily(location_count=30, angle_count=20), 0), step_s=step_s, limits=limits)
    grid = default_grid(problem)
    fastest = grid.speeds_deg_s[-1]
    assert fastest <= limits.speed_deg_s + 1e-9
    assert fastest >= 0.8 * min(limits.speed_deg_s, 29 * limits.acceleration_deg_s2 * step_s)
    strongest = grid.jumps[-1] * grid.speed_step_deg_s / step_s
    assert strongest <= limits.acceleration_deg_s2 * (1 + 1e-9)
    assert strongest >= 0.8 * min(limits.acceleration_deg_s2, 2.0 * fastest / step_s)
