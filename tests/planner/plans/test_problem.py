import math

import numpy as np
import pytest

from planner.map.config_map import ConfigurationMap
from planner.plans.problem import Problem, ProblemError
from planner.table.cost import Weights
from planner.table.motion import Limits

OPEN = ConfigurationMap(np.ones((4, 8)))


@pytest.mark.parametrize("wrong", [0.0, -1.0, math.nan, math.inf])
@pytest.mark.parametrize(
    ("field", "sentence"),
    [("step", "time step"), ("speed", "speed limit"), ("acceleration", "acceleration limit")],
)
def test_a_step_or_limit_that_is_not_positive_is_refused_by_name(field: str, sentence: str, wrong: float) -> None:
    numbers = {"step": 0.1, "speed": 40.0, "acceleration": 100.0, field: wrong}
    with pytest.raises(ProblemError, match=sentence):
        Problem(OPEN, numbers["step"], Limits(numbers["speed"], numbers["acceleration"]))


@pytest.mark.parametrize("wrong", [-1e-9, -1.0, math.nan, math.inf])
def test_a_weight_below_0_or_not_finite_is_refused_by_name(wrong: float) -> None:
    with pytest.raises(ProblemError, match="weight of the acceleration"):
        Problem(OPEN, weights=Weights(wrong, 1.0))
    with pytest.raises(ProblemError, match="weight of the speed"):
        Problem(OPEN, weights=Weights(1.0, wrong))


def test_weights_beyond_double_precision_are_refused() -> None:
    with pytest.raises(ProblemError, match="overflow"):
        Problem(OPEN, weights=Weights(1e305, 1.0))


def test_a_map_of_one_column_is_no_path() -> None:
    with pytest.raises(ProblemError, match="at least 2"):
        Problem(ConfigurationMap(np.ones((1, 8))))


@pytest.mark.parametrize("speed", [40.1, -41.0, math.nan])
def test_a_start_faster_than_the_limit_is_refused(speed: float) -> None:
    with pytest.raises(ProblemError, match="start speed"):
        Problem(OPEN, start_speed_deg_s=speed)


@pytest.mark.parametrize("angle", [math.nan, math.inf])
def test_a_start_angle_that_is_none_is_refused(angle: float) -> None:
    with pytest.raises(ProblemError, match="start angle"):
        Problem(OPEN, start_angle_deg=angle)


def test_by_default_either_limit_costs_a_tenth_of_a_black_location() -> None:
    problem = Problem(OPEN, limits=Limits(30.0, 50.0))
    assert problem.greatest_step_cost == pytest.approx(0.1 + 0.1 + 1.0)
    assert problem.terms.pause_cost > problem.greatest_step_cost
