"""The profiler against Ruckig, which plans time-optimal motions in closed form, and its invariants."""

import math
import random
from collections.abc import Iterator
from typing import Self

import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from ruckig import InputParameter, Result, Ruckig, Trajectory

from emulator.firmware.profiler import Profile, Reference, at_rest, retarget, step
from emulator.int32 import INT32_MAX

BITS = 26  # of the default table
ONE = 1 << BITS
TICK_S = 0.001
DEG = ONE * 512  # one degree, with 26 fraction bits, on the default table
DEG_S = DEG * TICK_S
DEG_S2 = DEG_S * TICK_S
SPEED_LIMIT = round(60.5 * DEG_S)  # the maximum of the registers
STANDING = Reference(0, 0, 0, 0, 0)

speeds = st.integers(1, SPEED_LIMIT)
accelerations = st.integers(1, ONE)
start_speeds = st.integers(-SPEED_LIMIT, SPEED_LIMIT)


def position(reference: Reference) -> int:
    return (reference.position_count << BITS) + reference.fraction


def distance_left(reference: Reference) -> int:
    return (reference.distance_count << BITS) + reference.distance_fraction


def run_to_rest(profile: Profile, reference: Reference, ticks: int) -> Iterator[Reference]:
    """Yield the reference now and after each tick until it stands; fail if it does not within `ticks`."""
    yield reference
    for _ in range(ticks):
        if at_rest(reference):
            return
        reference = step(profile, reference, BITS)
        yield reference
    assert at_rest(reference), f"still on its way after {ticks} ticks: {reference}"


def ruckig_trajectory(speed_deg_s: float, profile: Profile, distance_deg: float) -> Trajectory:
    """Return the time-optimal motion from 0 degrees at a speed to rest at a distance."""
    motion = InputParameter(1)
    motion.current_position, motion.current_velocity = [0.0], [speed_deg_s]
    motion.target_position, motion.target_velocity = [distance_deg], [0.0]
    motion.max_velocity = [profile.speed / DEG_S]
    motion.max_acceleration, motion.max_jerk = [profile.acceleration / DEG_S2], [math.inf]
    trajectory = Trajectory(1)
    assert Ruckig(1).calculate(motion, trajectory) == Result.Working
    return trajectory


def random_motion(chance: random.Random) -> tuple[Profile, int]:
    """Return S and A over their range, and a target ahead or behind, near or far, or at the present position."""
    speed_deg_s = 10 ** chance.uniform(-1.0, 1.6)
    acceleration_deg_s2 = 10 ** chance.uniform(-0.3, 2.0)
    distance_deg = chance.choice([0.0, chance.uniform(-1.0, 1.0) * 10 ** chance.uniform(-2.0, 1.5)])
    profile = Profile.of(round(speed_deg_s * DEG_S), round(acceleration_deg_s2 * DEG_S2))
    return profile, round(distance_deg * DEG)


@pytest.mark.parametrize("seed", range(4))
def test_pre_empted_motions_are_those_that_ruckig_plans(seed: int) -> None:
    """500 motions per seed; each interrupts the previous one at a random instant.

    Ruckig changes its acceleration at any instant, the profiler only between ticks. A change within a tick becomes the
    average of the tick. So speeds differ by less than the acceleration times half a tick, and positions by less than
    the acceleration times half a tick squared. Such differences do not add up: the profiler looks ahead at each tick.
    """
    chance = random.Random(seed)  # noqa: S311  # a test's draw
    reference = STANDING
    for _ in range(500):
        profile, distance = random_motion(chance)
        start = position(reference)
        reference = retarget(reference, distance, BITS)
        planned = ruckig_trajectory(reference.speed / DEG_S, profile, distance / DEG)
        ticks = 1 + int(chance.uniform(0.0, 1.1) * min(planned.duration / TICK_S, 2000.0))
        looks = {chance.randint(1, ticks) for _ in range(8)}
        for tick in range(1, ticks + 1):
            reference = step(profile, reference, BITS)
            if tick in looks:
                position_deg, speed_deg_s, _ = planned.at_time(min(tick * TICK_S, planned.duration))
                assert abs(reference.speed - speed_deg_s[0] * DEG_S) < profile.acceleration / 2 + 2
                assert abs(position(reference) - start - position_deg[0] * DEG) < profile.acceleration / 2 + 2


@settings(max_examples=300)
@given(speed=speeds, acceleration=accelerations, start_speed=start_speeds, distance=st.integers(-10 * DEG, 10 * DEG))
def test_speed_changes_by_at_most_the_acceleration_and_keeps_to_the_top_speed(
    speed: int, acceleration: int, start_speed: int, distance: int
) -> None:
    profile, reference = Profile.of(speed, acceleration), retarget(Reference(0, 0, start_speed, 0, 0), distance, BITS)
    for _ in range(300):
        before, reference = reference.speed, step(profile, reference, BITS)
        assert abs(reference.speed - before) <= acceleration
        assert abs(reference.speed) <= max(speed, abs(before) - acceleration)


@settings(max_examples=150, deadline=None)
@given(
    speed=st.integers(1, SPEED_LIMIT),
    ramp_ticks=st.integers(1, 400),
    start_ticks=st.integers(-400, 400),
    travel_ticks=st.integers(0, 600),
    offset=st.integers(-5, 5),
)
def test_every_motion_ends_at_rest_exactly_on_its_target(
    speed: int, ramp_ticks: int, start_ticks: int, travel_ticks: int, offset: int
) -> None:
    profile = Profile.of(speed, max(1, speed // ramp_ticks))
    start = Reference(0, 0, max(-speed, min(speed, start_ticks * profile.acceleration)), 0, 0)
    distance = travel_ticks * speed + offset
    *_, last = run_to_rest(profile, retarget(start, distance, BITS), 4000 + 4 * speed // profile.acceleration)
    assert position(last) == distance
    assert last == Reference(distance >> BITS, distance % ONE, 0, 0, 0)


@settings(max_examples=200, deadline=None)
@given(speed=st.integers(1, 40), acceleration=st.integers(1, 8), distance=st.integers(-400, 400))
@example(speed=1, acceleration=1, distance=1)
@example(speed=1, acceleration=8, distance=-1)
def test_the_smallest_registers_still_arrive(speed: int, acceleration: int, distance: int) -> None:
    """A unit is 2^-26 counts a tick: the truncation of the arithmetic is as large as the motion."""
    profile, start = Profile.of(speed, acceleration), retarget(STANDING, distance, BITS)
    for reference in run_to_rest(profile, start, 2000):
        assert abs(reference.speed) <= speed
        assert 0 <= distance_left(reference) * (1 if distance > 0 else -1) <= abs(distance)


@settings(max_examples=200, deadline=None)
@given(speed=speeds, acceleration=st.integers(ONE >> 12, ONE), spare=st.integers(0, 5 * DEG), share=st.floats(0, 1))
def test_no_overshoot_where_there_is_room_to_brake(speed: int, acceleration: int, spare: int, share: float) -> None:
    profile = Profile.of(speed, acceleration)
    start_speed = int(min(speed, 500 * acceleration) * share)
    braking = -(
        -start_speed * (start_speed + acceleration) // (2 * acceleration)
    )  # including the mean travel of a tick
    reference = retarget(Reference(0, 0, start_speed, 0, 0), braking + spare, BITS)
    for _ in range(1500):
        reference = step(profile, reference, BITS)
        assert distance_left(reference) >= 0
        assert reference.speed >= 0


@pytest.mark.parametrize("target", [0, 1, -1, 10 * DEG, 40 * DEG])
def test_a_target_too_near_is_passed_by_the_braking_distance_alone(target: int) -> None:
    """At 40 deg/s and 100 deg/s2 the table needs 8 degrees; it returns to a target within them."""
    profile = Profile.of(round(40 * DEG_S), round(100 * DEG_S2))
    start = Reference(0, 0, profile.speed, 0, 0)
    farthest = max(position(reference) for reference in run_to_rest(profile, retarget(start, target, BITS), 5000))
    assert farthest == pytest.approx(max(8 * DEG, target), abs=profile.acceleration)


@settings(max_examples=200)
@given(speed=speeds, acceleration=accelerations, start_speed=start_speeds, distance=st.integers(-(1 << 57), 1 << 57))
def test_backwards_is_the_mirror_image_of_forwards(
    speed: int, acceleration: int, start_speed: int, distance: int
) -> None:
    profile = Profile.of(speed, acceleration)
    forwards = retarget(Reference(0, 0, start_speed, 0, 0), distance, BITS)
    backwards = retarget(Reference(0, 0, -start_speed, 0, 0), -distance, BITS)
    for _ in range(50):
        forwards, backwards = step(profile, forwards, BITS), step(profile, backwards, BITS)
        assert (forwards.speed, distance_left(forwards)) == (-backwards.speed, -distance_left(backwards))
        assert position(forwards) == -position(backwards)


def test_the_counter_wraps_and_the_motion_goes_on() -> None:
    profile = Profile.of(round(40 * DEG_S), round(100 * DEG_S2))
    start = retarget(Reference(INT32_MAX - 100, 0, 0, 0, 0), 1000 * ONE, BITS)
    *_, last = run_to_rest(profile, start, 5000)
    assert last == Reference(-(2**31) + 899, 0, 0, 0, 0)


class Register(int):
    """An integer of a 64-bit machine: an operation whose result does not fit fails."""

    def __new__(cls, number: int) -> Self:
        assert -(1 << 63) <= number < 1 << 63, f"{number} does not fit 64 bits"
        return super().__new__(cls, number)

    def __add__(self, other: int) -> "Register":
        return Register(int(self) + other)

    def __sub__(self, other: int) -> "Register":
        return Register(int(self) - other)

    def __rsub__(self, other: int) -> "Register":
        return Register(other - int(self))

    def __mul__(self, other: int) -> "Register":
        return Register(int(self) * other)

    def __neg__(self) -> "Register":
        return Register(-int(self))

    def __lshift__(self, other: int) -> "Register":
        return Register(int(self) << other)

    def __rshift__(self, other: int) -> "Register":
        return Register(int(self) >> other)

    def __floordiv__(self, other: int) -> "Register":
        return Register(int(self) // other)

    __radd__, __rmul__ = __add__, __mul__


extremes = st.sampled_from([1, 2, 7, ONE >> 10, ONE >> 5, ONE - 1, ONE])


@settings(max_examples=400)
@given(
    speed=st.sampled_from([1, 1000, SPEED_LIMIT // 2, SPEED_LIMIT]),
    acceleration=extremes,
    start_speed=st.sampled_from([-SPEED_LIMIT, -1, 0, 1, SPEED_LIMIT]) | start_speeds,
    distance=st.sampled_from([1, ONE, (INT32_MAX + 1) << BITS]) | st.integers(0, (INT32_MAX + 1) << BITS),
    near_braking=st.booleans(),
)
def test_no_intermediate_result_exceeds_64_bits(
    speed: int, acceleration: int, start_speed: int, distance: int, near_braking: bool
) -> None:
    """The same source, run with checked integers, up to the ends of every range."""
    if near_braking:
        distance = start_speed * start_speed // (2 * acceleration)
    profile = Profile(*map(Register, Profile.of(speed, acceleration)))
    start = retarget(Reference(0, 0, start_speed, 0, 0), distance, BITS)
    reference = Reference(*map(Register, start))
    for _ in range(5):
        reference = step(profile, reference, BITS)
        assert abs(reference.speed) <= INT32_MAX
        assert -INT32_MAX - 1 <= reference.position_count <= INT32_MAX
        assert 0 <= reference.fraction < ONE
        assert 0 <= reference.distance_fraction < ONE
