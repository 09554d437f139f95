"""What can collide with what: the bodies that move with the arm, the obstacles of the cell, the pairs that can meet.

Neighbors in the chain of bodies touch by construction and are not a pair. How far the bodies of a pair are apart is
found in `planner.cell.clearance`.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from planner.arrays import BoolArray, FloatArray, IndexArray
from planner.cell.bodies import FLANGE_FRAME, WRIST_LINK, Bodies
from planner.cell.obstacles import Obstacle, bounding_box
from planner.geometry.signed_distance_field import NO_FIELD, SignedDistanceField
from planner.geometry.transforms import rotations_z

# The columns of the bodies' table: the frame that a body moves with, its ends there in mm, its radius in mm; of the
# housing, the first two half axes in the place of the ends, then its middle, and the length of the third half axis.
FRAME, START, END, RADIUS, MIDDLE, THIRD = 0, 1, 4, 7, 8, 11
# Those of the obstacles' table: the kind, three sizes, the least and the greatest x y z of a box around it, in mm.
KIND, SIZE, LOWER, UPPER = 0, 1, 4, 7

_FIXED_LINK = 0
_WRIST_FRAMES = (4, 5)
_BEAM = "beam"


class CollisionModel(NamedTuple):
    """What can collide with what, in the plain arrays that compiled kernels take; lengths in mm.

    A body is a part, or, as the last two, the housing and the beam. An obstacle is numbered after the bodies.

    Attributes:
        bodies: `(n_bodies, 12)`, one row each; the beam's ends are one mm apart.
        obstacles: `(n_obstacles, 10)`, the kind, three sizes, and a box around it in its own frame.
        field: Of the one obstacle that is a mesh.
        pairs: `(n_pairs, 2)`, a body and another one or an obstacle. Those of the flange's bodies with the obstacles
            come first: they are common to all configurations.
        n_common: How many those are.
        poses: `(n_obstacles, 4, 4)`, of the obstacles in the table's frame or the base's.
        turning: `(n_obstacles,)`, which of the two.
        T_BT: `(4, 4)`, the table's axis at angle 0 in the base.
        beam_gap_mm: What the beam stops short of the surface.
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
        ValueError: More than one obstacle is a field, or a part turns with joint 4 or 5.
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
    """Return the parts in their frames, a row each, the housing, and the beam, one mm long, in the flange's."""
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
    """Return `(n_angles, n_obstacles, 3, 4)`: the base's frame seen from each obstacle's, for each table angle."""
    table = (model.T_BT @ rotations_z(table_angles_deg))[:, None]
    in_base = np.where(model.turning[:, None, None], table @ model.poses, model.poses)
    return np.ascontiguousarray(np.linalg.inv(in_base)[:, :, :3])
