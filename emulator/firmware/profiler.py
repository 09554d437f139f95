"""The trapezoidal velocity profiler: the reference position and speed of the PID loop (Fig. 3 of the paper).

The profile is not planned ahead. At each tick the reference takes the greatest speed that the acceleration, the top
speed and the distance left to brake allow, so a new target, speed or acceleration may come at any time: the reference
goes on from where it is, at the speed that it has (Fig. 4). All numbers are integers; see `fixed_point`.
"""

from typing import NamedTuple

from emulator.firmware.fixed_point import POSITION_BITS, POSITION_MASK
from emulator.int32 import wrap_int32


class Profile(NamedTuple):
    """What one motion must keep."""

    speed: int  # the greatest, count/tick, 26 fraction bits
    acceleration: int  # count/tick^2, 26 fraction bits
    far: int  # count, 26 fraction bits; see `far_distance`

    @classmethod
    def of(cls, speed: int, acceleration: int) -> "Profile":
        """Return the profile of a motion command; both arguments are greater than 0."""
        return cls(speed, acceleration, far_distance(acceleration))


def far_distance(acceleration: int) -> int:
    """Return a distance from which any speed can be braked; up to it, `step` stays within 64 bits."""
    return (1 << 61) // acceleration


class Reference(NamedTuple):
    """Where the profile is, and its way to the target; both are words of whole counts and of 26 fraction bits."""

    position_count: int
    fraction: int
    speed: int  # count/tick, 26 fraction bits
    distance_count: int
    distance_fraction: int


def standing_at(count: int) -> Reference:
    """Return the reference of a table that stands at a count and has nowhere to go."""
    return Reference(count, 0, 0, 0, 0)


def at_rest(reference: Reference) -> bool:
    """Tell whether the profile has reached its target and stands."""
    return reference.speed == 0 and reference.distance_count == 0 and reference.distance_fraction == 0


def retarget(reference: Reference, distance: int) -> Reference:
    """Return the reference with a new target, `distance` (26 fraction bits) away; position and speed go on."""
    return Reference(
        reference.position_count,
        reference.fraction,
        reference.speed,
        distance >> POSITION_BITS,
        distance & POSITION_MASK,
    )


def step(profile: Profile, reference: Reference) -> Reference:
    """Return the reference one tick later."""
    position_count, fraction, speed, distance_count, distance_fraction = reference
    distance = (distance_count << POSITION_BITS) + distance_fraction
    if distance > 0 or (distance == 0 and speed < 0):
        speed, advance = _towards(profile, speed, distance)
    else:
        speed, advance = _towards(profile, -speed, -distance)
        speed, advance = -speed, -advance
    fraction += advance
    distance -= advance
    return Reference(
        wrap_int32(position_count + (fraction >> POSITION_BITS)),
        fraction & POSITION_MASK,
        speed,
        distance >> POSITION_BITS,
        distance & POSITION_MASK,
    )


def _towards(profile: Profile, speed: int, distance: int) -> tuple[int, int]:
    """Return the next speed, and the way made until then, for a target ahead (`distance` >= 0).

    From the next speed v' the table brakes at a over v'^2 / 2a. It stops in time when
    (v + v') / 2 + v'^2 / 2a <= distance, that is v'^2 + a (v + v') <= 2 a distance.
    """
    top_speed, acceleration, far = profile
    slowest, fastest = speed - acceleration, speed + acceleration
    if slowest > top_speed:
        fastest = slowest
    elif fastest > top_speed:
        fastest = top_speed
    if 0 <= speed <= acceleration and (2 * distance < speed or distance <= (acceleration >> 2) + 2):
        return 0, distance  # the rest of the way is shorter than a tick
    if fastest > 0 and distance < far:
        room = 2 * acceleration * distance - acceleration * speed
        if fastest * (fastest + acceleration) > room:
            fastest = max(_greatest_root(acceleration, room, fastest), slowest)
    return fastest, (speed + fastest) >> 1


def _greatest_root(acceleration: int, room: int, above: int) -> int:
    """Return the greatest whole v >= 0 with v (v + a) <= room, or 0; `above` is not less than it.

    Newton's method from above, on a convex function: it falls until it is there, mostly within three rounds.
    """
    if room <= 0:
        return 0
    root = above
    lower = (root * root + room) // (2 * root + acceleration)
    while lower < root:
        root = lower
        lower = (root * root + room) // (2 * root + acceleration)
    return root
