import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.interpolate import RegularGridInterpolator

from planner.map.config_map import ConfigurationMap, ConfigurationMapError

ANGLES = st.floats(-2000.0, 2000.0)


def random_map(seed: int, locations: int = 6, angles: int = 12, forbidden: float = 0.0) -> ConfigurationMap:
    generator = np.random.default_rng(seed)
    values = generator.uniform(0.1, 1.0, (locations, angles))
    values[generator.random(values.shape) < forbidden] = 0.0
    return ConfigurationMap(values)


def scipy_value(configuration_map: ConfigurationMap, location: float, angle_deg: float) -> float:
    wrapped = np.hstack([configuration_map.values, configuration_map.values[:, :1]])
    axes = (np.arange(configuration_map.location_count), np.linspace(0.0, 360.0, configuration_map.angle_count + 1))
    return float(RegularGridInterpolator(axes, wrapped)((location, angle_deg % 360.0)))


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 9), st.floats(0.0, 5.0), ANGLES)
def test_an_open_map_is_scipys_bilinear_interpolation_around_the_cylinder(
    seed: int, location: float, angle_deg: float
) -> None:
    configuration_map = random_map(seed)
    expected = scipy_value(configuration_map, location, angle_deg)
    assert configuration_map.value(location, angle_deg) == pytest.approx(expected, abs=1e-6)


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 9), st.floats(0.0, 5.0), ANGLES)
def test_a_point_is_allowed_only_if_every_sample_with_a_weight_is(seed: int, location: float, angle_deg: float) -> None:
    configuration_map = random_map(seed, forbidden=0.3)
    position = angle_deg / configuration_map.angle_step_deg
    corners = [
        configuration_map.allowed[k, i % configuration_map.angle_count]
        for k in {math.floor(location), math.ceil(location)}
        for i in {math.floor(position), math.ceil(position)}
    ]
    # Within the tolerance of a sample, its neighbors have no weight.
    if min(abs(x - round(x)) for x in (location, position)) > 1e-8:
        assert configuration_map.is_allowed(location, angle_deg) == all(corners)


def test_next_to_a_forbidden_sample_nothing_but_the_allowed_sample_itself_is_allowed() -> None:
    configuration_map = ConfigurationMap(np.array([[1.0, 0.0, 1.0, 1.0]]))
    assert configuration_map.is_allowed(0, 180.0)
    assert not configuration_map.is_allowed(0, 179.999)
    assert configuration_map.is_allowed(0, 180.001)


@pytest.mark.parametrize("index", range(7))
def test_a_sample_is_met_at_its_angle_on_every_turn(index: int) -> None:
    values = np.zeros((1, 7))
    values[0, index] = 0.5
    configuration_map = ConfigurationMap(values)
    for turn in (-11, -1, 0, 1, 30):
        assert configuration_map.value(0, configuration_map.angles_deg[index] + 360.0 * turn) == 0.5


def test_the_rounded_zero_of_equation_1_is_forbidden() -> None:
    assert not ConfigurationMap(np.full((1, 4), math.sin(math.pi) ** 0.2)).allowed.any()


def test_blocked_locations_are_named() -> None:
    values = np.ones((4, 5))
    values[[1, 3]] = 0.0
    assert ConfigurationMap(values).blocked_locations == (1, 3)


def test_a_map_is_a_frozen_copy() -> None:
    source = np.ones((2, 4))
    configuration_map = ConfigurationMap(source, reasons=np.zeros((2, 4), dtype=np.uint8), metadata={"seed": 1})
    source[0, 0] = 0.0
    assert configuration_map.values.all()
    with pytest.raises(ValueError, match="read-only"):
        configuration_map.values[0, 0] = 0.0


@pytest.mark.parametrize("wrong", [math.nan, math.inf, -0.01, 1.01])
def test_a_value_that_is_none_is_refused_with_its_place(wrong: float) -> None:
    values = np.ones((3, 4))
    values[2, 1] = wrong
    with pytest.raises(ConfigurationMapError, match="location 2, angle index 1"):
        ConfigurationMap(values)


@pytest.mark.parametrize("shape", [(0, 4), (4, 1), (4,), (2, 2, 2)])
def test_a_shape_that_is_no_map_is_refused(shape: tuple[int, ...]) -> None:
    with pytest.raises(ConfigurationMapError, match="shape"):
        ConfigurationMap(np.ones(shape))


def test_reasons_of_another_shape_are_refused() -> None:
    with pytest.raises(ConfigurationMapError, match="reasons"):
        ConfigurationMap(np.ones((2, 4)), reasons=np.zeros((4, 2), dtype=np.uint8))


@pytest.mark.parametrize("epsilon", [-0.1, 1.0, math.nan])
def test_an_epsilon_that_forbids_all_or_nothing_is_refused(epsilon: float) -> None:
    with pytest.raises(ConfigurationMapError, match="epsilon"):
        ConfigurationMap(np.ones((2, 4)), epsilon=epsilon)


@pytest.mark.parametrize("location", [-0.1, 5.1, math.nan])
def test_a_point_off_the_map_is_refused(location: float) -> None:
    with pytest.raises(ConfigurationMapError, match="outside of the map"):
        random_map(1).value(location, 0.0)


def test_the_way_to_the_nearest_forbidden_sample_goes_round_either_side() -> None:
    values = np.ones((2, 360))
    values[0, [10, 350]] = 0.0
    configuration_map = ConfigurationMap(values)
    for angle_deg, way_deg in ((0.0, 10.0), (5.5, 4.5), (-7.0, 3.0), (180.0, 170.0), (720.0 + 349.0, 1.0)):
        assert configuration_map.forbidden_distance_deg(0, angle_deg) == pytest.approx(way_deg)
    assert configuration_map.forbidden_distance_deg(1, 0.0) == math.inf
