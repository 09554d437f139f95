"""Random configuration maps of known difficulty with a fixed seed, for tests, benchmarks and figures."""

from typing import NamedTuple

import numpy as np
from scipy.ndimage import gaussian_filter, grey_dilation

from planner.arrays import FloatArray
from planner.map.config_map import ConfigurationMap


class MapFamily(NamedTuple):
    """The common properties of the maps of a family.

    Attributes:
        forbidden: approximate share of the map that is forbidden.
        obstacle_size: scale of the forbidden regions, in samples.
        slope: drift of the whole pattern, in samples of angle per column: the table has to turn to follow it.
        location_count: columns.
        angle_count: samples of angle.
    """

    forbidden: float = 0.3
    obstacle_size: float = 6.0
    slope: float = 0.0
    location_count: int = 100
    angle_count: int = 100


def smooth_noise(generator: np.random.Generator, shape: tuple[int, int], size: float) -> FloatArray:
    """Return noise of a given scale, uniformly distributed over 0..1, periodic along the second axis."""
    noise = gaussian_filter(generator.standard_normal(shape), size, mode=("nearest", "wrap"))
    ranks = np.argsort(np.argsort(noise, axis=None)).reshape(shape)
    return ranks / (ranks.size - 1)


def synthetic_map(family: MapFamily, seed: int) -> ConfigurationMap:
    """Return one map of the family: forbidden regions, with values that rise with the distance from them."""
    generator = np.random.default_rng(seed)
    shape = (family.location_count, family.angle_count)
    regions = smooth_noise(generator, shape, family.obstacle_size)
    brightness = smooth_noise(generator, shape, 2.0 * family.obstacle_size)
    margin = np.clip((regions - family.forbidden) / max(1.0 - family.forbidden, 1e-9), 0.0, 1.0)
    values = np.where(regions >= family.forbidden, np.sqrt(margin) * (0.5 + 0.5 * brightness), 0.0)
    for k in range(family.location_count):
        values[k] = np.roll(values[k], round(family.slope * k))
    return ConfigurationMap(values, metadata={"family": family._asdict(), "seed": seed})


def blocks_map(
    location_count: int, angle_count: int, blocks: list[tuple[int, int, int, int]], edge: int = 4
) -> ConfigurationMap:
    """Return a bright map with rectangular obstacles, gray for `edge` samples around them.

    Args:
        location_count: columns.
        angle_count: samples of angle.
        blocks: (first location, last location, first angle, last angle) of each obstacle, samples, inclusive.
        edge: width of the gray border.
    """
    forbidden = np.zeros((location_count, angle_count))
    for first, last, low, high in blocks:
        forbidden[first : last + 1, low : high + 1] = 1.0
    shade = forbidden.copy()
    for width in range(1, edge + 1):
        ring = grey_dilation(forbidden, size=(2 * width + 1, 2 * width + 1), mode="nearest")
        shade = np.maximum(shade, ring * (1.0 - width / (edge + 1.0)))
    return ConfigurationMap(np.where(forbidden > 0.0, 0.0, 1.0 - 0.8 * shade))
