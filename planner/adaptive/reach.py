"""Which strips the arm can sweep: at which table angle, in which configuration, and how far along each.

A pose is allowed where the configuration map allows it (reach, joint limits, singularities, collisions). A strip is
swept in one configuration while the table stands or turns slowly: from one pose to the next it may go as far as the
table can turn in that time, over allowed angles.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from planner.adaptive.surroundings import Surroundings
from planner.arrays import BoolArray, FloatArray, IndexArray
from planner.cell.obstacles import Obstacle
from planner.kinematics.configuration import Configuration
from planner.map.map_builder import build_maps
from protocol.program.progress import Progress

ANGLES = 36
"""Table angles over one turn at which the reach is looked for."""


class Reach(NamedTuple):
    """What of each strip can be swept.

    Attributes:
        first: `(n,)` the first pose that can be swept.
        last: `(n,)` the last one; as `first` where nothing can.
        configurations: `(n,)` in which `Configuration`.
    """

    first: IndexArray
    last: IndexArray
    configurations: IndexArray

    @property
    def counts(self) -> IndexArray:
        """`(n,)` how many poses can be swept; 1 where nothing can."""
        return self.last - self.first + 1


def allowed(
    surroundings: Surroundings, solid: Obstacle, T_WS: FloatArray, progress: Progress | None = None
) -> BoolArray:
    """Return at which table angles each pose `(n, 4, 4)` is allowed in each configuration, `(8, n, ANGLES)`."""
    problem = surroundings.map_problem(np.ascontiguousarray(T_WS), solid)
    maps = build_maps(problem, list(Configuration), ANGLES, progress)
    return np.stack([maps[each].allowed for each in Configuration])


def reach(allowed_poses: BoolArray, turn_samples: int) -> Reach:
    """Return the longest part of each strip that can be swept.

    Args:
        allowed_poses: `(8, n, k, angles)` for `n` strips of `k` poses.
        turn_samples: How many samples of the table's angle it can turn from one pose to the next.
    """
    configurations, n, k, _ = allowed_poses.shape
    best = Reach(np.zeros(n, dtype=np.int64), np.zeros(n, dtype=np.int64), np.zeros(n, dtype=np.int64))
    for c in range(configurations):
        for start in range(k - 1):
            alive = allowed_poses[c, :, start]
            for end in range(start + 1, k):
                alive = _stepped(alive, allowed_poses[c, :, end - 1], allowed_poses[c, :, end], turn_samples)
                longer = alive.any(axis=1) & (end - start > best.last - best.first)
                best.first[longer], best.last[longer], best.configurations[longer] = start, end, c
    return best


def _stepped(alive: BoolArray, here: BoolArray, there: BoolArray, turn_samples: int) -> BoolArray:
    """Return the angles `(n, angles)` that can be had at the next pose, from those that can be had at this one."""
    both = here & there
    reached = alive & both
    for turned in (1, -1):
        front = alive & both
        for _ in range(turn_samples):
            front = np.roll(front, turned, axis=1) & both
            reached |= front
    return np.asarray(reached)


def trimmed(T_WS: FloatArray, found: Reach) -> list[FloatArray]:
    """Return the part of each strip `(n, k, 4, 4)` that can be swept, as `(j, 4, 4)`."""
    return [poses[first : last + 1] for poses, first, last in zip(T_WS, found.first, found.last, strict=True)]


def usable(found: Reach, fewest_poses: int) -> IndexArray:
    """Return the numbers of the strips of which at least so many poses can be swept."""
    return np.flatnonzero(found.counts >= fewest_poses)


def filled_up(strips: Sequence[FloatArray], k: int) -> tuple[FloatArray, IndexArray]:
    """Return strips `(j, 4, 4)` as one array `(n, k, 4, 4)` that repeats last poses, and the number of each one's."""
    poses = np.stack([np.concatenate((each, np.repeat(each[-1:], k - len(each), axis=0))) for each in strips])
    return poses, np.array([len(each) - 1 for each in strips], dtype=np.int64)
