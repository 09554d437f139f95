"""The trapezoidal velocity profiler: the reference position and speed of the PID loop (Fig. 3 of the paper).

The profile is not planned in advance. At each tick the reference takes the maximum speed that the acceleration, the
maximum speed and the remaining braking distance allow. So a new target, speed or acceleration may come at any time: the
reference continues from its present position and speed (Fig. 4). All numbers are integers with `bits` fraction bits,
see `fixed_point`.
"""

from typing import NamedTuple

from emulator.int32 import wrap_int32


class Profile(NamedTuple):
    """The limits of one motion."""

    speed: int  # maximum, count/tick
    acceleration: int  # count/tick^2
    far: int  # count; see `far_distance`

    @classmethod
    def of(cls, speed: int, acceleration: int) -> "Profile":
        """Return the profile of a motion command; both arguments are greater than 0."""
        return cls(speed, acceleration, far_distance(acceleration))


def far_distance(acceleration: int) -> int:
    """Return a distance that is sufficient for braking from any speed. Up to it, `step` stays within 64 bits."""
    return (1 << 61) // acceleration


class Reference(NamedTuple):
    """The state of the profile, and the distance to its target.

    Each has a word of whole counts and a word of the fraction.
    """

    position_count: int
    fraction: int
    speed: int  # count/tick
    distance_count: int
    distance_fraction: int


def standing_at(count: int) -> Reference:
    """Return the reference of a table that stands at a count without a motion."""
    return Reference(count, 0, 0, 0, 0)


def at_rest(reference: Reference) -> bool:
    """Return whether the profile has reached its target and stands."""
    return reference.speed == 0 and reference.distance_count == 0 and reference.distance_fraction == 0


def retarget(reference: Reference, distance: int, bits: int) -> Reference:
    """Return the reference with a new target at `distance`. Position and speed continue."""
    return Reference(
        reference.position_count,
        reference.fraction,
        reference.speed,
        distance >> bits,
        distance & ((1 << bits) - 1),
    )


def step(profile: Profile, reference: Reference, bits: int) -> Reference:
    """Return the reference one tick later."""
    position_count, fraction, speed, distance_count, distance_fraction = reference
    distance = (distance_count << bits) + distance_fraction
    if distance > 0 or (distance == 0 and speed < 0):
        speed, advance = _towards(profile, speed, distance)
    else:
        speed, advance = _towards(profile, -speed, -distance)
        speed, advance = -speed, -advance
    fraction += advance
    distance -= advance
    mask = (1 << bits) - 1
    return Reference(
        wrap_int32(position_count + (fraction >> bits)),
        fraction & mask,
        speed,
        distance >> bits,
        distance & mask,
    )


def _towards(profile: Profile, speed: int, distance: int) -> tuple[int, int]:
    """Return the next speed, and the travel until then, for a target ahead (`distance` >= 0).

    From the next speed v', the braking distance at a is v'^2 / 2a. The table stops in time if (v + v') / 2 + v'^2 / 2a
    <= distance, that is v'^2 + a (v + v') <= 2 a distance.
    """
    top_speed, acceleration, far = profile
    slowest, fastest = speed - acceleration, speed + acceleration
    if slowest > top_speed:
        fastest = slowest
    elif fastest > top_speed:
        fastest = top_speed
    if 0 <= speed <= acceleration and (2 * distance < speed or distance <= (acceleration >> 2) + 2):
        return 0, distance  # the rest of the travel is shorter than a tick
    if fastest > 0 and distance < far:
        room = 2 * acceleration * distance - acceleration * speed
        if fastest * (fastest + acceleration) > room:
            fastest = max(_greatest_root(acceleration, room, fastest), slowest)
    return fastest, (speed + fastest) >> 1


def _greatest_root(acceleration: int, room: int, above: int) -> int:
    """Return the largest integer v >= 0 with v (v + a) <= room, or 0; `above` is not less than v.

    Newton's method from above on a convex function: it decreases to the solution, mostly within three iterations.
    """
    if room <= 0:
        return 0
    root = above
    lower = (root * root + room) // (2 * root + acceleration)
    while lower < root:
        root = lower
        lower = (root * root + room) // (2 * root + acceleration)
    return root
