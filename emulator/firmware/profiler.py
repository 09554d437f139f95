"""The trapezoidal velocity profiler: the reference position and speed of the PID loop (Fig. 3 of the paper).

The profile is not planned ahead. At each tick the reference takes the greatest speed that the acceleration, the top
speed and the distance left to brake allow, so a new target, speed or acceleration may come at any time: the reference
goes on from where it is, at the speed that it has (Fig. 4). All numbers are integers; `bits` are
their fraction bits, see `fixed_point`.
"""

from typing import NamedTuple

from emulator.int32 import wrap_int32


class Profile(NamedTuple):
    """What one motion must keep."""

    speed: int  # the greatest, count/tick
    acceleration: int  # count/tick^2
    far: int  # count; see `far_distance`

    @classmethod
    def of(cls, speed: int, acceleration: int) -> "Profile":
        """Return the profile of a motion command; both arguments are greater than 0."""
        return cls(speed, acceleration, far_distance(acceleration))


def far_distance(acceleration: int) -> int:
    """Return a distance from which any speed can be braked; up to it, `step` stays within 64 bits."""
    return (1 << 61) // acceleration


class Reference(NamedTuple):
    """Where the profile is, and its way to the target; both are a word of whole counts and a word of the fraction."""

    position_count: int
    fraction: int
    speed: int  # count/tick
    distance_count: int
    distance_fraction: int


def standing_at(count: int) -> Reference:
    """Return the reference of a table that stands at a count and has nowhere to go."""
    return Reference(count, 0, 0, 0, 0)


def at_rest(reference: Reference) -> bool:
    """Tell whether the profile has reached its target and stands."""
    return reference.speed == 0 and reference.distance_count == 0 and reference.distance_fraction == 0


def retarget(reference: Reference, distance: int, bits: int) -> Reference:
    """Return the reference with a new target, `distance` away; position and speed go on."""
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
