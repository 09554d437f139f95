import numpy as np

from planner.map.config_map import ConfigurationMap
from planner.planning.best_configuration import best_configuration
from planner.planning.dynamic_programming import dynamic_programming
from planner.planning.plan import NoPlan, Plan
from planner.planning.problem import Problem


def problem_of(value: float, configuration: str) -> Problem:
    return Problem(ConfigurationMap(np.full((5, 8), value), metadata={"configuration": configuration}))


def test_the_configuration_of_the_cheapest_plan_wins_and_none_is_left_out() -> None:
    problems = {"righty": problem_of(0.4, "righty"), "lefty": problem_of(0.9, "lefty"), "flip": problem_of(0.0, "flip")}
    comparison = best_configuration(problems, dynamic_programming)
    assert comparison.best == "lefty"
    assert list(comparison.outcomes) == ["righty", "lefty", "flip"]
    best = comparison.outcomes["lefty"]
    assert isinstance(best, Plan)
    assert best.configuration == "lefty"
    assert isinstance(comparison.outcomes["flip"], NoPlan)


def test_where_no_configuration_can_cross_none_is_best() -> None:
    asked = {"a": problem_of(0.0, "a"), "b": problem_of(0.0, "b")}
    assert best_configuration(asked, dynamic_programming).best is None
