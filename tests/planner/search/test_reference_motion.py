import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from planner.map.config_map import ConfigurationMap
from planner.plans.problem import Problem
from planner.search.reference_motion import ACCELERATION_SHARE, reference_motion
from planner.table.motion import Limits, roll_out


@settings(max_examples=60, deadline=None)
@given(
    start_deg=st.none() | st.floats(-1000.0, 1000.0),
    start_share=st.none() | st.floats(-1.0, 1.0),
    step_s=st.sampled_from([0.05, 0.25, 1.0]),
    angle_count=st.sampled_from([7, 36, 360]),
)
def test_it_starts_as_asked_and_rests_on_a_sample_within_the_limits(
    start_deg: float | None, start_share: float | None, step_s: float, angle_count: int
) -> None:
    limits = Limits()
    speed = None if start_share is None else start_share * limits.speed_deg_s
    problem = Problem(ConfigurationMap(np.ones((200, angle_count))), step_s, limits, None, start_deg, speed)
    motion = reference_motion(problem)
    if start_deg is not None:
        assert motion.angles_deg[0] == start_deg
    assert motion.speeds_deg_s[0] == pytest.approx(speed or 0.0)
    assert motion.speeds_deg_s[-1] == motion.accelerations_deg_s2[-1] == 0.0
    sample = motion.angles_deg[-1] / problem.map.angle_step_deg
    assert sample == pytest.approx(round(sample), abs=1e-9)
    assert np.abs(motion.accelerations_deg_s2).max() <= limits.acceleration_deg_s2
    angles, speeds = roll_out(motion.angles_deg[0], motion.speeds_deg_s[0], motion.accelerations_deg_s2, step_s)
    assert motion.angles_deg == pytest.approx(angles, abs=1e-9)
    assert motion.speeds_deg_s == pytest.approx(speeds, abs=1e-9)


@pytest.mark.parametrize(("share", "steps"), [(0.01, 2), (-0.99, 2), (1.99, 2), (2.01, 3), (-6.99, 7)])
def test_a_start_comes_to_rest_in_the_smallest_number_of_steps(share: float, steps: int) -> None:
    limits, step_s = Limits(100.0, 50.0), 0.1
    speed = share * ACCELERATION_SHARE * limits.acceleration_deg_s2 * step_s  # as a multiple of what a step can change
    problem = Problem(ConfigurationMap(np.ones((20, 36))), step_s, limits, start_speed_deg_s=speed)
    motion = reference_motion(problem)
    assert np.flatnonzero(motion.speeds_deg_s).tolist() == list(range(steps))


def test_a_start_at_rest_on_a_sample_stays_there() -> None:
    problem = Problem(ConfigurationMap(np.ones((5, 36))), start_angle_deg=-350.0)
    assert reference_motion(problem).angles_deg.tolist() == [-350.0] * 5


@pytest.mark.parametrize("location_count", [2, 3])
def test_a_path_too_short_to_come_to_rest_still_has_a_reference(location_count: int) -> None:
    problem = Problem(ConfigurationMap(np.ones((location_count, 36))), 0.1, start_angle_deg=1.0, start_speed_deg_s=40.0)
    motion = reference_motion(problem)
    angles, speeds = roll_out(1.0, 40.0, motion.accelerations_deg_s2, 0.1)
    assert motion.angles_deg == pytest.approx(angles)
    assert motion.speeds_deg_s == pytest.approx(speeds)
