import numpy as np
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from planner.map.config_map import ConfigurationMap
from planner.plans.crossing import free_runs, step_is_allowed
from planner.table.motion import swept_angles

STEP_S = 0.5


@settings(max_examples=200, deadline=None)
@given(st.integers(0, 50), st.floats(-400.0, 400.0), st.floats(-60.0, 60.0), st.floats(-200.0, 200.0))
def test_the_exact_check_agrees_with_very_many_sub_steps(
    seed: int, angle: float, speed: float, acceleration: float
) -> None:
    generator = np.random.default_rng(seed)
    configuration_map = ConfigurationMap(np.where(generator.random((2, 24)) < 0.12, 0.0, 0.5))
    samples = np.array(swept_angles(angle, speed, acceleration, STEP_S)) / configuration_map.angle_step_deg
    # Only the exact check may decide about a motion that ends very close to a sample.
    assume(np.abs(samples - np.round(samples)).min() > 1e-3)
    t = np.linspace(0.0, 1.0, 1500)[1:-1] * STEP_S
    way = angle + speed * t + 0.5 * acceleration * t**2
    allowed = all(configuration_map.is_allowed(s, a) for s, a in zip(t / STEP_S, way, strict=True))
    runs = free_runs(configuration_map.allowed)
    assert step_is_allowed(runs, 0, angle, speed, acceleration, STEP_S) == allowed


def test_runs_continue_around_the_turn_and_end_at_either_columns_obstacle() -> None:
    allowed = np.ones((2, 6), dtype=np.bool_)
    allowed[0, 2] = allowed[1, 4] = False
    assert free_runs(allowed).tolist() == [[2, 1, 0, 1, 0, 3]]


def test_an_open_turn_may_be_swept_any_number_of_times() -> None:
    runs = free_runs(np.ones((2, 5), dtype=np.bool_))
    assert step_is_allowed(runs, 0, 0.0, 5000.0, 0.0, 1.0)


def test_a_table_at_rest_on_a_sample_needs_that_sample_alone() -> None:
    allowed = np.zeros((2, 4), dtype=np.bool_)
    allowed[:, 1] = True
    runs = free_runs(allowed)
    assert step_is_allowed(runs, 0, 90.0, 0.0, 0.0, 1.0)
    assert not step_is_allowed(runs, 0, 90.1, 0.0, 0.0, 1.0)


def test_a_table_that_reverses_meets_what_lies_beyond_both_ends() -> None:
    allowed = np.ones((2, 36), dtype=np.bool_)
    allowed[:, 6] = False
    runs = free_runs(allowed)
    # 49 deg -> 55 deg -> 49 deg: only the turning point is in the cell before the obstacle at 60 deg.
    assert not step_is_allowed(runs, 0, 49.0, 24.0, -48.0, 1.0)
    assert step_is_allowed(runs, 0, 49.0, 0.0, 0.0, 1.0)
