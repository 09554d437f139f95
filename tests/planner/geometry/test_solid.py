from collections.abc import Callable

import coal
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from planner.geometry.solid import BOX, CAPSULE, CYLINDER, point_distance, solid_distance

FAR = float("inf")
coordinate = st.integers(-200, 200).map(float)
point = st.tuples(coordinate, coordinate, coordinate).map(np.array)
SIZES = {BOX: (40.0, 60.0, 15.0), CYLINDER: (50.0, 20.0, 0.0), CAPSULE: (30.0, 45.0, 0.0)}
ORACLES: dict[int, Callable[[], object]] = {
    BOX: lambda: coal.Box(80.0, 120.0, 30.0),
    CYLINDER: lambda: coal.Cylinder(50.0, 40.0),
    CAPSULE: lambda: coal.Capsule(30.0, 90.0),
}


def distance(kind: int, a: NDArray[np.float64], b: NDArray[np.float64], enough_mm: float = FAR) -> float:
    (ax, ay, az), (bx, by, bz) = (map(float, end) for end in (a, b))
    return solid_distance(kind, *SIZES[kind], ax, ay, az, bx, by, bz, enough_mm)


@pytest.mark.parametrize("kind", [BOX, CYLINDER, CAPSULE])
def test_a_capsule_is_as_far_from_a_solid_as_coal_says(kind: int) -> None:
    rng = np.random.default_rng(kind)
    request, radius, compared = coal.DistanceRequest(), 12.0, 0
    request.gjk_tolerance = 1e-9
    for a, b in rng.uniform(-200, 200, (600, 2, 3)):
        length = float(np.linalg.norm(b - a))
        rotation = coal.Quaternion.FromTwoVectors(np.array([0.0, 0.0, 1.0]), (b - a) / length).matrix()
        capsule, pose = coal.Capsule(radius, length), coal.Transform3s(rotation, (a + b) / 2)
        oracle = coal.distance(
            capsule, pose, ORACLES[kind](), coal.Transform3s.Identity(), request, coal.DistanceResult()
        )
        ours = distance(kind, a, b) - radius
        if ours > -radius:  # deeper inside, the two libraries define depth differently
            compared += 1
            assert ours == pytest.approx(oracle, abs=1e-4)
    assert compared > 300


@pytest.mark.parametrize("kind", [BOX, CYLINDER])
@settings(deadline=None)
@given(a=point, b=point)
def test_the_distance_of_a_segment_is_the_least_of_its_points(
    kind: int, a: NDArray[np.float64], b: NDArray[np.float64]
) -> None:
    along = np.linspace(a, b, 201)
    sampled = min(point_distance(kind, *SIZES[kind], *map(float, sample))[0] for sample in along)
    exact = distance(kind, a, b)
    assert exact <= sampled + 1e-6
    assert sampled - exact <= np.linalg.norm(b - a) / 400 + 1e-6


@pytest.mark.parametrize("kind", [BOX, CYLINDER])
@settings(deadline=None)
@given(a=point)
def test_the_gradient_is_the_slope_of_the_distance(kind: int, a: NDArray[np.float64]) -> None:
    a = a + np.array([0.31, 0.17, 0.23])  # off the edges, where the distance has no slope
    step = 1e-6
    value, *gradient = point_distance(kind, *SIZES[kind], *map(float, a))
    assert np.linalg.norm(gradient) == pytest.approx(1.0)
    moved = point_distance(kind, *SIZES[kind], *map(float, a - step * np.array(gradient)))[0]
    assert value - moved == pytest.approx(step, rel=1e-3)


@pytest.mark.parametrize("kind", [BOX, CYLINDER, CAPSULE])
@settings(deadline=None)
@given(a=point, b=point, enough_mm=st.floats(-20, 100))
def test_a_bound_never_changes_a_distance_below_it(
    kind: int, a: NDArray[np.float64], b: NDArray[np.float64], enough_mm: float
) -> None:
    exact, bounded = distance(kind, a, b), distance(kind, a, b, enough_mm)
    if exact < enough_mm:
        assert bounded == pytest.approx(exact, abs=1e-6)
    else:
        assert bounded >= enough_mm - 1e-6
