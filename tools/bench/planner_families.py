"""Families of planning problems: easy and hard maps, by name and seed."""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from planner.map.config_map import ConfigurationMap, sample_at_or_above, sample_at_or_below
from planner.map.synthetic_maps import MapFamily, smooth_noise, synthetic_map
from planner.plans.problem import Problem
from planner.table.cost import Weights, default_weights
from planner.table.motion import Limits, Motion, roll_out, swept_angles


class Family(NamedTuple):
    """A family of problems.

    Attributes:
        name: the printed name.
        problem: creates the problem of a seed.
        map_count: number of maps.
    """

    name: str
    problem: Callable[[int], Problem]
    map_count: int = 20


def weights(factor: float) -> Weights:
    """Return the default weights times a factor."""
    return Weights(*(weight * factor for weight in default_weights(Limits())))


def of_maps(maps: MapFamily, step_s: float = 0.25, weight_factor: float = 1.0) -> Callable[[int], Problem]:
    """Return problems on synthetic maps."""
    return lambda seed: Problem(synthetic_map(maps, seed), step_s, weights=weights(weight_factor))


def of_noise(forbidden: float) -> Callable[[int], Problem]:
    """Return problems on maps whose every sample is independent of its neighbors."""

    def problem(seed: int) -> Problem:
        generator = np.random.default_rng(seed)
        values = 0.05 + 0.95 * generator.random((100, 100))
        values[generator.random(values.shape) < forbidden] = 0.0
        return Problem(ConfigurationMap(values), 0.25)

    return problem


def near_the_limit(seed: int) -> Problem:
    """Return a problem that starts between the samples at nearly the maximum speed."""
    family = MapFamily(0.2, 4.0)
    brightest = int(np.argmax(synthetic_map(family, seed).values[0]))
    start_deg = 3.6 * brightest + 1.234
    return Problem(synthetic_map(family, seed), 0.25, start_angle_deg=start_deg, start_speed_deg_s=39.0 + 0.04 * seed)


def corridor(
    angle_count: int, limit_deg_s: float, drift_deg_s: float, width: int, start_speed_deg_s: float | None
) -> Problem:
    """Return a map that is forbidden except for a band of the given number of samples.

    The band drifts at a speed near the limit.
    """
    generator = np.random.default_rng(width)
    values = np.zeros((60, angle_count))
    for k in range(60):
        first = int(np.ceil(drift_deg_s * 0.25 * k * angle_count / 360.0)) - width // 2
        values[k, (first + np.arange(width)) % angle_count] = 0.3 + 0.7 * generator.random(width)
    return Problem(ConfigurationMap(values), 0.25, Limits(limit_deg_s), start_speed_deg_s=start_speed_deg_s)


def fast_corridor(seed: int) -> Problem:
    """Return one of 42 bands of 8 to 16 samples that drift at 0.90 to 1.00 of the limit."""
    share, width = 0.90 + 0.02 * (seed % 6), 8 + 2 * (seed // 6 % 5)
    return corridor(100, 40.0, share * 40.0, width, None if seed % 2 else 0.0)


def fast_fine_corridor(seed: int) -> Problem:
    """Return a band of 30 of 360 samples that drifts at 39 of 39.5 deg/s."""
    return corridor(360, 39.5, 39.0, 30, (None, 0.0, 30.0, 39.0)[seed % 4])


def of_gaps(width: int) -> Callable[[int], Problem]:
    """Return problems with a wall every 8 to 13 columns, each with a gap of some samples in one column."""

    def problem(seed: int) -> Problem:
        generator = np.random.default_rng(seed)
        values = 0.05 + 0.9 * smooth_noise(generator, (100, 100), 3.0)
        every = 8 + seed % 6
        for k in range(every, 100, every):
            gap = (generator.integers(100) + np.arange(width)) % 100
            wall = np.ones(100, dtype=np.bool_)
            wall[gap] = False
            values[k, wall] = 0.0
        return Problem(ConfigurationMap(values), 0.5)

    return problem


class KnownMotion(NamedTuple):
    """A map that is forbidden except for the angles of a motion, and that motion."""

    problem: Problem
    motion: Motion


def around_a_motion(seed: int) -> KnownMotion:
    """Return a map that a known motion crosses, with hardly any space for another one.

    The seed determines step, limits, samples, smoothness of the motion and width of the corridor.
    """
    generator = np.random.default_rng(seed)
    columns, angle_count = int(generator.integers(10, 80)), int(generator.choice([36, 60, 90, 100, 180]))
    step_s = float(generator.choice([0.1, 0.25, 0.5, 1.0]))
    limits = Limits(float(generator.choice([12.0, 25.0, 40.0])), float(generator.choice([20.0, 100.0, 300.0])))
    motion = random_motion(generator, columns, step_s, limits)
    margin = int(generator.integers(0, 4))
    values = np.zeros((columns + 1, angle_count))
    for k in range(columns):
        low, high = swept_angles(motion.angles_deg[k], motion.speeds_deg_s[k], motion.accelerations_deg_s2[k], step_s)
        first = sample_at_or_below(low * angle_count / 360.0) - margin
        last = sample_at_or_above(high * angle_count / 360.0) + margin
        values[k : k + 2, np.arange(first, last + 1) % angle_count] = 1.0
    values *= generator.uniform(0.2, 1.0, values.shape)
    is_free = generator.random() < 0.3
    return KnownMotion(
        Problem(
            ConfigurationMap(values),
            step_s,
            limits,
            start_angle_deg=None if is_free else float(motion.angles_deg[0]),
            start_speed_deg_s=None if is_free else float(motion.speeds_deg_s[0]),
        ),
        motion,
    )


def random_motion(generator: np.random.Generator, steps: int, step_s: float, limits: Limits) -> Motion:
    """Return a motion within the limits: gentle or wild, often at one of them."""
    wildness = float(generator.choice([0.1, 0.5, 2.0]))
    start_speed = speed = float(generator.uniform(-1.0, 1.0)) * limits.speed_deg_s
    accelerations = np.empty(steps)
    for k in range(steps):
        wanted = float(generator.normal()) * wildness * limits.acceleration_deg_s2
        within = np.clip(wanted, -limits.acceleration_deg_s2, limits.acceleration_deg_s2)
        target = np.clip(speed + within * step_s, -limits.speed_deg_s, limits.speed_deg_s)
        accelerations[k] = (target - speed) / step_s
        speed = float(target)
    start_deg = float(generator.uniform(-400.0, 400.0))
    return Motion(*roll_out(start_deg, start_speed, accelerations, step_s), accelerations)


FAMILIES = (
    Family("5 % forbidden", of_maps(MapFamily(0.05, 6.0))),
    Family("20 % forbidden", of_maps(MapFamily(0.2, 6.0))),
    Family("40 % forbidden", of_maps(MapFamily(0.4, 6.0))),
    Family("small obstacles", of_maps(MapFamily(0.15, 2.0))),
    Family("large obstacles", of_maps(MapFamily(0.4, 10.0))),
    Family("drifting pattern", of_maps(MapFamily(0.4, 8.0, 1.0))),
    Family("drift 0.7 of limit", of_maps(MapFamily(0.4, 6.0, 1.94))),
    Family("light weights", of_maps(MapFamily(0.3, 5.0), weight_factor=0.1)),
    Family("heavy weights", of_maps(MapFamily(0.3, 5.0), weight_factor=30.0)),
    Family("short steps", of_maps(MapFamily(0.2, 6.0), 0.1)),
    Family("long steps", of_maps(MapFamily(0.3, 5.0), 1.0)),
    Family("noise, 2 % forbidden", of_noise(0.02)),
    Family("noise, 10 % forbidden", of_noise(0.1)),
    Family("fine obstacles", of_maps(MapFamily(0.15, 1.0))),
    Family("fine, light weights", of_maps(MapFamily(0.15, 1.0), weight_factor=0.1)),
    Family("fine, heavy weights", of_maps(MapFamily(0.15, 1.0), weight_factor=30.0)),
    Family("fine, short steps", of_maps(MapFamily(0.15, 1.0), 0.1)),
    Family("start near the limit", near_the_limit),
    Family("fast corridors", fast_corridor, 42),
    Family("fast fine corridors", fast_fine_corridor, 4),
    Family("gaps of 1 sample", of_gaps(1)),
    Family("gaps of 2 samples", of_gaps(2)),
    Family("gaps of 3 samples", of_gaps(3)),
    Family("gaps of 5 samples", of_gaps(5)),
    Family("around a motion", lambda seed: around_a_motion(seed).problem, 40),
)
