"""The collision model: the bodies that move with the arm, the obstacles of the cell, and the pairs that can collide.

Neighbors in the chain of bodies touch by construction and are not a pair. `planner.cell.clearance` computes the
distances of the pairs.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from planner.arrays import BoolArray, FloatArray, IndexArray
from planner.cell.bodies import FLANGE_FRAME, WRIST_LINK, Bodies
from planner.cell.obstacles import Obstacle, bounding_box
from planner.geometry.signed_distance_field import NO_FIELD, SignedDistanceField
from planner.geometry.transforms import rotations_z

# The columns of the table of bodies: the frame that a body moves with, its ends in that frame in mm, its radius in mm.
# The housing has its first two half axes instead of the ends, then its middle, and the length of the third half axis.
FRAME, START, END, RADIUS, MIDDLE, THIRD = 0, 1, 4, 7, 8, 11
# The columns of the table of obstacles: the kind, three sizes, and the minimum and maximum x y z of its bounding box,
# in mm.
KIND, SIZE, LOWER, UPPER = 0, 1, 4, 7

_FIXED_LINK = 0
_WRIST_FRAMES = (4, 5)
_BEAM = "beam"


class CollisionModel(NamedTuple):
    """The collision model in the plain arrays that compiled kernels take; lengths in mm.

    A body is a part, or, as the last two, the housing and the beam. Obstacles are numbered after the bodies.

    Attributes:
        bodies: `(n_bodies, 12)`, one row each; the beam has a length of 1 mm.
        obstacles: `(n_obstacles, 10)`, the kind, three sizes, and its bounding box in its own frame.
        field: the field of the one obstacle that is a mesh.
        pairs: `(n_pairs, 2)`, a body and another body or an obstacle. Pairs of the flange's bodies with the obstacles
            are first: they are common to all configurations.
        n_common: number of these pairs.
        poses: `(n_obstacles, 4, 4)`, the obstacles in the frame of the table or of the base.
        turning: `(n_obstacles,)`, whether the frame is that of the table.
        T_BT: `(4, 4)`, the table at angle 0 in the base.
        beam_gap_mm: distance from the end of the beam to the surface.
    """

    bodies: FloatArray
    obstacles: FloatArray
    field: SignedDistanceField
    pairs: IndexArray
    n_common: int
    poses: FloatArray
    turning: BoolArray
    T_BT: FloatArray
    beam_gap_mm: float

    def beam_mm(self, stand_off_mm: float) -> float:
        """Return the beam's length for a stand-off."""
        return max(stand_off_mm - self.beam_gap_mm, 0.0)


def collision_model(
    bodies: Bodies, obstacles: Sequence[Obstacle], T_BT: FloatArray, T_FS: FloatArray
) -> tuple[CollisionModel, tuple[str, ...]]:
    """Return the model and the name of each of its pairs, such as "probe and table".

    Raises:
        ValueError: more than one obstacle is a field, or a part moves with joint 4 or 5.
    """
    if any(part.frame in _WRIST_FRAMES for part in bodies.parts):
        raise ValueError("a part moves with frame 4 or 5; both flips of the wrist must put every part in one place")
    fields = [obstacle.field for obstacle in obstacles if obstacle.field is not None]
    if len(fields) > 1:
        raise ValueError(f"{len(fields)} obstacles are meshes, the collision model takes one")
    pairs, n_common = _pairs(bodies, obstacles)
    model = CollisionModel(
        bodies=_body_table(bodies, T_FS),
        obstacles=_obstacle_table(obstacles),
        field=fields[0] if fields else NO_FIELD,
        pairs=pairs,
        n_common=n_common,
        poses=np.array([obstacle.pose for obstacle in obstacles]).reshape(-1, 4, 4),
        turning=np.array([obstacle.turning for obstacle in obstacles], dtype=np.bool_),
        T_BT=np.array(T_BT, dtype=np.float64),
        beam_gap_mm=bodies.beam.gap_mm,
    )
    names = [
        *(part.name for part in bodies.parts),
        bodies.housing.name,
        _BEAM,
        *(obstacle.name for obstacle in obstacles),
    ]
    return model, tuple(f"{names[first]} and {names[second]}" for first, second in pairs)


def _body_table(bodies: Bodies, T_FS: FloatArray) -> FloatArray:
    """Return the parts in their frames, one row each.

    Then follow the housing and a beam of 1 mm, in the frame of the flange.
    """
    start, axis = T_FS[:3, 3], T_FS[:3, 2]
    table = np.zeros((len(bodies.parts) + 2, THIRD + 1))
    table[:-2, : RADIUS + 1] = [[part.frame, *part.start_mm, *part.end_mm, part.radius_mm] for part in bodies.parts]
    T_FH, half_mm = bodies.housing.T_FH, bodies.housing.half_mm
    half_axes = T_FH[:3, :3] * half_mm
    table[-2] = FLANGE_FRAME, *half_axes[:, 0], *half_axes[:, 1], 0.0, *T_FH[:3, 3], half_mm[2]
    table[-1, : RADIUS + 1] = FLANGE_FRAME, *start, *(start + axis), bodies.beam.radius_mm
    return table


def _obstacle_table(obstacles: Sequence[Obstacle]) -> FloatArray:
    rows = [[each.kind, *each.size_mm, *np.concatenate(bounding_box(each))] for each in obstacles]
    return np.array(rows).reshape(-1, 10)


def _pairs(bodies: Bodies, obstacles: Sequence[Obstacle]) -> tuple[IndexArray, int]:
    """Return the pairs that can meet, those common to all arm configurations first, and how many those are."""
    links = [*(part.link for part in bodies.parts), bodies.housing.link]
    beam = len(links)
    numbered = list(enumerate(obstacles, beam + 1))
    tool = [body for body, link in enumerate(links) if link >= WRIST_LINK]
    arm = [body for body, link in enumerate(links) if _FIXED_LINK < link < WRIST_LINK]
    common = [(body, number) for body in tool for number, _ in numbered]
    common += [(beam, number) for number, obstacle in numbered if obstacle.stops_light]
    others = [(body, number) for body in arm for number, _ in numbered]
    others += [(a, b) for a in range(beam) for b in range(a) if abs(links[a] - links[b]) > 1]
    others += [(beam, body) for body, link in enumerate(links) if link < WRIST_LINK]
    return np.array([*common, *others], dtype=np.int64).reshape(-1, 2), len(common)


def base_in_obstacles(model: CollisionModel, table_angles_deg: FloatArray) -> FloatArray:
    """Return `(n_angles, n_obstacles, 3, 4)`: the base's frame in the frame of each obstacle, for each table angle."""
    table = (model.T_BT @ rotations_z(table_angles_deg))[:, None]
    in_base = np.where(model.turning[:, None, None], table @ model.poses, model.poses)
    return np.ascontiguousarray(np.linalg.inv(in_base)[:, :, :3])
