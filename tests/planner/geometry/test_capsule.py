from math import cos, sin

import coal
import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from planner.geometry.capsule import segment_distance

Points = NDArray[np.float64]

coordinate = st.integers(-50, 50).map(lambda tenth: tenth / 10)
point = st.tuples(coordinate, coordinate, coordinate)


def distance(a: Points, b: Points, c: Points, d: Points) -> float:
    return segment_distance(*map(float, (*a, *b, *c, *d)))


@settings(deadline=None)
@given(a=point, b=point, c=point, d=point)
@example(a=(0, 0, 0), b=(1, 0, 0), c=(3, 1, 0), d=(5, 1, 0))  # parallel, one behind the other
@example(a=(0, 0, 0), b=(4, 0, 0), c=(1, 2, 0), d=(2, 2, 0))  # parallel, side by side
@example(a=(1, 1, 1), b=(1, 1, 1), c=(0, 0, 0), d=(0, 0, 0))  # two points
def test_the_distance_of_two_segments_is_the_least_over_both(a: Points, b: Points, c: Points, d: Points) -> None:
    a, b, c, d = map(np.array, (a, b, c, d))
    fast = distance(a, b, c, d)
    grid = np.linspace(0, 1, 41)
    first = a + grid[:, None] * (b - a)
    second = c + grid[:, None] * (d - c)
    sampled = np.linalg.norm(first[:, None] - second[None], axis=2).min()
    assert fast <= sampled + 1e-9
    assert sampled - fast <= (np.linalg.norm(b - a) + np.linalg.norm(d - c)) / 80 + 1e-9
    assert fast == pytest.approx(distance(d, c, a, b), abs=1e-9)


@settings(deadline=None)
@given(angle=st.sampled_from([0.0, 1e-12, 1e-9, 1e-8, 1e-7, 1e-6, 1e-4]), shift=st.floats(-300, 300))
def test_nearly_parallel_segments_keep_their_distance(angle: float, shift: float) -> None:
    half = 150 * np.array([cos(angle), sin(angle), 0.0])
    middle = np.array([shift, 0.0, 40.0])
    a, b = np.array([-150.0, 0.0, 0.0]), np.array([150.0, 0.0, 0.0])
    # The lines cross, seen from above, in the middle of the second segment.
    beyond = max(abs(shift) - 300.0 * (1 + cos(angle)) / 2, 0.0)
    expected = 40.0 if abs(shift) <= 150.0 else None
    if expected is not None:
        assert distance(a, b, middle - half, middle + half) == pytest.approx(expected, abs=1e-6)
    assert distance(a, b, middle - half, middle + half) >= np.hypot(40.0, beyond) - 1e-6


def test_capsules_are_as_far_apart_as_coal_says() -> None:
    rng = np.random.default_rng(1)
    request = coal.DistanceRequest()
    for _ in range(500):
        ends = rng.uniform(-300, 300, (4, 3))
        radii = rng.uniform(5, 60, 2)
        shapes, poses = [], []
        for (start, end), radius in zip(ends.reshape(2, 2, 3), radii, strict=True):
            along = end - start
            length = float(np.linalg.norm(along))
            rotation = coal.Quaternion.FromTwoVectors(np.array([0.0, 0.0, 1.0]), along / length).matrix()
            shapes.append(coal.Capsule(radius, length))
            poses.append(coal.Transform3s(rotation, (start + end) / 2))
        result = coal.DistanceResult()
        oracle = coal.distance(shapes[0], poses[0], shapes[1], poses[1], request, result)
        assert distance(*ends) - radii.sum() == pytest.approx(oracle, abs=1e-5)
