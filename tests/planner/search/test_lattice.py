"""The rows of a step, compared with the crossing rule for each single step."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from planner.map.config_map import ConfigurationMap, column_value
from planner.plans.crossing import step_is_allowed
from planner.plans.problem import Problem
from planner.search.lattice import ANY_COST, Lattice, lay_out_step, make_rows, margin, motion_along, speed_unit
from planner.table.motion import Limits, Motion, roll_out


def noise(seed: int, angle_count: int, forbidden: float) -> ConfigurationMap:
    generator = np.random.default_rng(seed)
    values = generator.uniform(0.1, 1.0, (4, angle_count))
    values[generator.random(values.shape) < forbidden] = 0.0
    values[1, :] = np.where(generator.random() < 0.2, 0.5, values[1, :])
    return ConfigurationMap(values)


def reference(seed: int, is_on_a_sample: bool, step_s: float) -> Motion:
    generator = np.random.default_rng(seed)
    if is_on_a_sample:
        return Motion(np.zeros(4), np.zeros(4), np.zeros(3))
    accelerations = generator.uniform(-50.0, 50.0, 3)
    start = float(generator.uniform(-400.0, 400.0)), float(generator.uniform(-20.0, 20.0))
    return Motion(*roll_out(*start, accelerations, step_s), accelerations)


@settings(max_examples=30, deadline=None)
@given(
    seed=st.integers(0, 10_000),
    angle_count=st.sampled_from([8, 17, 36]),
    forbidden=st.floats(0.0, 0.6),
    is_on_a_sample=st.booleans(),
    nodes_per_sample=st.sampled_from([1, 2, 3, 6]),
)
def test_a_step_has_room_exactly_where_the_crossing_rule_allows_it(
    seed: int, angle_count: int, forbidden: float, is_on_a_sample: bool, nodes_per_sample: int
) -> None:
    step_s = 0.3
    problem = Problem(noise(seed, angle_count, forbidden), step_s, Limits(1e4, 1e6))
    node_deg = 360.0 / angle_count / nodes_per_sample
    half = 4
    lattice = Lattice(reference(seed, is_on_a_sample, step_s), node_deg, half, -6, 12, is_closed=False)
    unit, motion = speed_unit(lattice, step_s), lattice.reference
    rows = make_rows(lattice)
    for k in (2, 1, 0):
        lay_out_step(problem.terms, lattice, k, rows)
        for i in range(-half, half + 1):
            for j in range(-half, half + 1):
                for q in range(-6, 6):
                    row, place = i & 1, q + (i >> 1) + 6 + margin(lattice)
                    angle = motion.angles_deg[k] + (2 * q + i) * node_deg
                    speed, later = motion.speeds_deg_s[k] + i * unit, motion.speeds_deg_s[k + 1] + j * unit
                    turn = speed * speed * step_s / (2.0 * abs(speed - later) * node_deg) if speed * later < 0 else 0.0
                    above, below = rows.room_above[row, place], rows.room_below[row, place]
                    fits = above >= i + j and below >= -(i + j)
                    fits = fits and (rows.turn_above if speed > 0.0 else rows.turn_below)[row, place] >= turn - 1e-10
                    expected = step_is_allowed(problem.terms.runs, k, angle, speed, (later - speed) / step_s, step_s)
                    assert fits == expected, (k, i, j, q)


@pytest.mark.parametrize("is_on_a_sample", [True, False])
def test_a_node_costs_what_the_map_says_there(is_on_a_sample: bool) -> None:
    problem = Problem(noise(3, 36, 0.3), 0.3)
    lattice = Lattice(reference(3, is_on_a_sample, 0.3), 2.5, 3, -10, 20, is_closed=False)
    rows = make_rows(lattice)
    for k in (2, 1, 0):
        lay_out_step(problem.terms, lattice, k, rows)
        for place in range(rows.value_cost.shape[1]):
            for parity in (0, 1):
                node = 2 * (place - 10 - margin(lattice)) + parity
                angle = lattice.reference.angles_deg[k + 1] + node * 2.5
                value = column_value(problem.map.values, problem.map.epsilon, k + 1, angle)
                cost = float(rows.value_cost[parity, place])
                if value > problem.map.epsilon:
                    assert cost * problem.greatest_step_cost == pytest.approx(1.0 - value, abs=1e-6)
                else:
                    assert cost > ANY_COST


def test_a_path_of_a_lattice_is_a_motion() -> None:
    lattice = Lattice(reference(1, False, 0.3), 1.5, 5, -50, 100, is_closed=False)
    motion = motion_along(lattice, 4, np.array([0, 2, -3, 1]), 0.3)
    angles, speeds = roll_out(motion.angles_deg[0], motion.speeds_deg_s[0], motion.accelerations_deg_s2, 0.3)
    assert motion.angles_deg == pytest.approx(angles, abs=1e-9)
    assert motion.speeds_deg_s == pytest.approx(speeds, abs=1e-9)
