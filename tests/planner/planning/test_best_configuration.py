import numpy as np

from planner.map.config_map import ConfigurationMap
from planner.planning.best_configuration import Comparison, best_configuration
from planner.planning.dynamic_programming import dynamic_programming
from planner.plans.plan import Infeasibility, NoPlan, Plan
from planner.plans.problem import Problem
from planner.reasons import Reason
from tests.planner.winding_arm import winding_arm


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


def test_progress_is_told_before_and_after_each_configuration() -> None:
    told: list[tuple[int, int]] = []
    problems = {name: problem_of(0.5, name) for name in "ab"}
    best_configuration(problems, dynamic_programming, lambda done, total: told.append((done, total)))
    assert told == [(0, 2), (1, 2), (2, 2)]


def test_where_no_configuration_can_cross_none_is_best() -> None:
    asked = {"a": problem_of(0.0, "a"), "b": problem_of(0.0, "b")}
    assert best_configuration(asked, dynamic_programming).best is None


def test_the_refusal_is_that_of_the_configuration_that_gets_farthest() -> None:
    outcomes = {
        "a": NoPlan("p", Infeasibility.BLOCKED_LOCATION, 3),
        "b": NoPlan("p", Infeasibility.ARM, 17, Reason.JOINT_6_SPEED),
        "c": NoPlan("p", Infeasibility.START_FORBIDDEN),
    }
    refusal = Comparison(outcomes, None).refusal
    assert refusal == "b gets farthest: p: no motion was found that the arm can follow (joint 6 speed, location 17)"


def test_a_cheaper_plan_that_the_arm_cannot_follow_does_not_win() -> None:
    follows, slow = winding_arm(0.0), winding_arm(90.0, speed_6_deg_s=10.0)
    problems = {
        name: Problem(ConfigurationMap(np.full((5, 8), value)), arm=arm)
        for name, value, arm in (("bright", 0.9, slow), ("dark", 0.4, follows))
    }
    assert best_configuration(problems, dynamic_programming).best == "dark"
    assert best_configuration({"bright": problems["bright"]}, dynamic_programming).best == "bright"
