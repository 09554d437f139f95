"""Chapters 7.1 and 7.2: a motion from rest, and its end."""

from collections.abc import Sequence
from math import sqrt
from statistics import median

from protocol.conformance.cases.case import case
from protocol.conformance.judgement.reference import Expectation, Sample
from protocol.conformance.judgement.rig import Rig, cruising_speed
from protocol.conformance.judgement.verdict import NonconformityError, require

_RAMP_DEG = 5.0
"""Minimum travel for measuring an acceleration from readings with a resolution of a tenth of a degree."""
_RAMP_READINGS = 18
"""Minimum number of readings for measuring an acceleration."""
_LEAST_SPREAD = 1e-6
"""Below this number of readings, a least-squares line is fitted to a single point."""


@case("7.1/1", travel_deg=30)
def a_long_motion_is_a_trapezoid(rig: Rig) -> None:
    """Measure maximum speed, acceleration and deceleration of a motion long enough to reach S."""
    allowed = rig.profile.motion
    _travel(rig, 30, *_readable(rig, 30, allowed.speed_deg_s / 2, allowed.acceleration_deg_s2 / 4))
    _measure_trapezoid(rig)


@case("7.1/1:backwards", travel_deg=30)
def a_long_motion_backwards_is_a_trapezoid(rig: Rig) -> None:
    """Measure maximum speed, acceleration and deceleration of a backward motion, with other values of S and A."""
    allowed = rig.profile.motion
    _travel(rig, -30, *_readable(rig, 30, allowed.speed_deg_s, allowed.acceleration_deg_s2))
    _measure_trapezoid(rig)


@case("7.1/2", travel_deg=10)
def a_short_motion_is_a_triangle(rig: Rig) -> None:
    """Move by less than S^2/A: the table accelerates for half of the travel and decelerates for the other half."""
    rate = rig.profile.motion.acceleration_deg_s2 / 5
    _travel(rig, 0.5 * min(10.0, rig.profile.motion.speed_deg_s**2 / rate), rig.profile.motion.speed_deg_s, rate)


@case("7.1/3", travel_deg=30)
def a_motion_takes_its_time(rig: Rig) -> None:
    """Compare the duration of a long motion with the trapezoid."""
    allowed = rig.profile.motion
    _travel(rig, 30, *_unhurried(rig, 30, allowed.speed_deg_s / 2, allowed.acceleration_deg_s2 / 2))
    _measure_duration(rig)


@case("7.1/3:triangle", travel_deg=10)
def a_short_motion_takes_its_time(rig: Rig) -> None:
    """Compare the duration of a motion too short to reach S with the triangular profile."""
    allowed = rig.profile.motion
    _travel(rig, 10, *_unhurried(rig, 10, allowed.speed_deg_s, allowed.acceleration_deg_s2 / 5))
    _measure_duration(rig)


@case("7.1/4", travel_deg=20)
def a_motion_does_not_pass_its_target(rig: Rig) -> None:
    """Move as fast as allowed, and find the maximum position during the motion and the settling."""
    rig.full_settings()
    rig.move_to(20)
    rig.follow()
    rig.follow(rig.profile.tolerance.settling_s / 2)
    rig.finish()
    farthest = max(sample.position_deg for sample in rig.motion.samples) - rig.home_deg - 20
    allowed = rig.profile.tolerance.tracking_deg + rig.profile.resolution_deg / 2
    rig.measure("farthest position minus target", farthest, "deg", most=allowed)


@case("7.1/5", travel_deg=20)
def the_speed_stays_within_s(rig: Rig) -> None:
    """Measure the maximum speed of a motion over intervals of a tenth of a second."""
    top = rig.profile.motion.speed_deg_s / 2
    _travel(rig, 20, top, rig.profile.motion.acceleration_deg_s2)
    window_s = 0.1
    samples = _certain(rig)
    speeds = [
        (later.position_deg - one.position_deg) / (later.time_s - one.time_s)
        for index, one in enumerate(samples)
        for later in samples[index + 1 :]
        if window_s <= later.time_s - one.time_s <= 2 * window_s
    ]
    jitter = (rig.profile.step_deg + top * rig.profile.serial.latency_s / 2) / window_s
    excess = max(speeds, default=0.0) - top
    rig.measure("maximum speed minus S", excess, "deg/s", most=top * rig.profile.tolerance.speed_share + jitter)


@case("7.2/1", travel_deg=5)
def the_table_holds_its_target(rig: Rig) -> None:
    """Read the position for half a second after a motion."""
    rig.move_to(5)
    rig.finish()
    readings = []
    for _ in range(10):
        readings.append(rig.read())
        rig.wire.clock.sleep_s(0.05)
    require(len(set(readings)) == 1, f"readings at rest range from {min(readings)} to {max(readings)} deg")


@case("7.2/2", travel_deg=20)
def the_table_comes_to_rest_at_its_target(rig: Rig) -> None:
    """Approach targets from both directions, with short and long travel."""
    rig.settings(rig.profile.motion.speed_deg_s, rig.profile.motion.acceleration_deg_s2)
    for target in (20, 19.9, 0.2, 0.25, -0.05, 0):
        rig.move_to(target)
        rig.finish(f"at {target:g}")


@case("7.2/3", travel_deg=20)
def the_table_settles_soon(rig: Rig) -> None:
    """Measure the time from the end of the profile until the table stays at its target."""
    rig.settings(rig.profile.motion.speed_deg_s, rig.profile.motion.acceleration_deg_s2)
    rig.move_to(20)
    rig.follow()
    target, settling_s = rig.home_deg + 20, rig.profile.tolerance.settling_s
    rig.follow(1.2 * settling_s)
    expected = rig.motion.expectations[-1]
    allowed = rig.profile.tolerance.rest_deg + rig.profile.resolution_deg / 2
    away = [sample.time_s for sample in rig.motion.samples if abs(sample.position_deg - target) > allowed]
    over_s = max(away) - expected.began_s - expected.motion.duration_s
    rig.measure("settling", max(over_s, 0.0), "s", most=settling_s)


@case("7.2/4", travel_deg=10)
def errors_do_not_add_up(rig: Rig) -> None:
    """Move forward and backward five times. Each end position repeats the first one."""
    rig.settings(rig.profile.motion.speed_deg_s, rig.profile.motion.acceleration_deg_s2)
    for _ in range(5):
        for target in (5, 0):
            rig.move_to(target)
            rig.follow()
            rig.wait_for_rest()
    rig.finish("after ten motions")


def _travel(rig: Rig, distance_deg: float, top_deg_s: float, rate_deg_s2: float) -> None:
    rig.settings(top_deg_s, rate_deg_s2)
    rig.move_to(distance_deg)
    rig.finish()


def _readable(rig: Rig, distance_deg: float, top_deg_s: float, rate_deg_s2: float) -> tuple[float, float]:
    """Return S and A, reduced until both ramps can be measured and a third of the travel lies between them."""
    rate_deg_s2 = min(rate_deg_s2, top_deg_s**2 / (2 * _RAMP_DEG))
    top_deg_s, rate_deg_s2 = _unhurried(rig, distance_deg, top_deg_s, rate_deg_s2)
    return min(top_deg_s, cruising_speed(distance_deg, rate_deg_s2)), rate_deg_s2


def _unhurried(rig: Rig, distance_deg: float, top_deg_s: float, rate_deg_s2: float) -> tuple[float, float]:
    """Return S and A, with A reduced until each ramp of a motion takes the time of the given number of readings."""
    ramp_s = _RAMP_READINGS * rig.reading_s
    return top_deg_s, min(rate_deg_s2, top_deg_s / ramp_s, 2 * distance_deg / (3 * ramp_s**2))


def _measure_trapezoid(rig: Rig) -> None:
    """Measure acceleration, maximum speed and deceleration, each by a straight line."""
    motion = rig.motion.expectations[-1].motion
    up, cruise, down = motion.segments
    top, rate = rig.top_deg_s, rig.rate_deg_s2
    speed_share = rig.profile.tolerance.speed_share
    settled_s = up.duration_s + min(0.1, cruise.duration_s / 3)
    slowing_s = up.duration_s + cruise.duration_s - min(0.05, cruise.duration_s / 6)
    top_measured = abs(_slope(_within(rig, settled_s, slowing_s)))
    rig.measure("top speed", top_measured, "deg/s", top * (1 - speed_share), top * (1 + speed_share))
    share = rig.profile.tolerance.acceleration_share
    for name, origin_deg, begin_s, end_s in (
        ("acceleration", motion.start.angle_deg, 0.1 * up.duration_s, up.duration_s),
        (
            "deceleration",
            motion.target_deg,
            motion.duration_s - down.duration_s,
            motion.duration_s - 0.1 * down.duration_s,
        ),
    ):
        # With a constant acceleration from or to rest, sqrt(2 x) is a line of slope sqrt(A).
        roots = [
            sample._replace(position_deg=sqrt(2 * abs(sample.position_deg - origin_deg)))
            for sample in _within(rig, begin_s, end_s)
        ]
        rig.measure(name, _slope(roots) ** 2, "deg/s2", rate * (1 - share), rate * (1 + share))


def _measure_duration(rig: Rig) -> None:
    """Measure the relative duration of a motion: the slope of measured times over the times of the trapezoid."""
    expected = rig.motion.expectations[-1]
    duration_s = expected.motion.duration_s
    pairs = [
        Sample(_time_of(expected, sample.position_deg), sample.time_s, 0.0)
        for sample in _within(rig, 0.1 * duration_s, 0.9 * duration_s)
    ]
    tolerance = rig.profile.tolerance
    allowed_s = max(tolerance.duration_share * duration_s, tolerance.duration_s)
    rig.measure("duration", _slope(pairs) * duration_s, "s", duration_s - allowed_s, duration_s + allowed_s)


def _time_of(expected: Expectation, position_deg: float) -> float:
    """Return when the reference of a motion from rest reaches a position, by bisection."""
    low_s, high_s = 0.0, expected.motion.duration_s
    forwards = expected.motion.target_deg > expected.motion.start.angle_deg
    for _ in range(40):
        middle_s = (low_s + high_s) / 2
        if (expected.motion.at(middle_s)[0] < position_deg) == forwards:
            low_s = middle_s
        else:
            high_s = middle_s
    return low_s


def _within(rig: Rig, begin_s: float, end_s: float) -> list[Sample]:
    """Return the readings of a time interval since the last command."""
    began_s = rig.motion.expectations[-1].began_s
    return [sample for sample in _certain(rig) if begin_s <= sample.time_s - began_s <= end_s]


def _certain(rig: Rig) -> list[Sample]:
    """Return the readings without those whose time is much less certain than usual: something delayed them."""
    samples = rig.motion.samples
    allowed_s = median(sample.uncertainty_s for sample in samples) + rig.profile.serial.latency_s
    return [sample for sample in samples if sample.uncertainty_s <= allowed_s]


def _slope(samples: Sequence[Sample]) -> float:
    """Return the slope of the least-squares line."""
    if len(samples) < 4:
        raise NonconformityError(f"only {len(samples)} positions were read; at least 4 are needed")
    mean_s = sum(sample.time_s for sample in samples) / len(samples)
    spread = sum((sample.time_s - mean_s) ** 2 for sample in samples)
    if spread < _LEAST_SPREAD:
        raise NonconformityError(f"all {len(samples)} readings of the position are equal")
    return sum((sample.time_s - mean_s) * sample.position_deg for sample in samples) / spread
