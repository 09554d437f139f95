"""A carrier without a table: the probe is simply held along each strip, for tests of what a policy asks for."""

from collections.abc import Sequence

import numpy as np
import trimesh
from scipy.spatial.transform import Rotation, Slerp

from planner.adaptive.policy import Returned
from planner.adaptive.strip import Strip
from planner.arrays import FloatArray
from planner.cell.obstacles import Obstacle
from planner.geometry.ray_casting import RayCaster
from planner.scanning.alignment import aligned
from planner.scanning.coverage import Coverage
from planner.scanning.probe import LaserProbe, Sight, measure

SPACING_MM = 1.5


class HandHeldProbe:
    """Measures a mesh along strips, with the probe's noise, and keeps account of what was seen."""

    def __init__(self, mesh: trimesh.Trimesh, probe: LaserProbe) -> None:
        self._caster, self._probe = RayCaster(mesh), probe
        self.coverage = Coverage(mesh, self._caster, probe, 2.0)
        self.strips: list[Strip] = []

    def ordered(self, strips: Sequence[Strip], solid: Obstacle) -> Sequence[Strip]:  # noqa: ARG002 - as `Carrier`
        return strips

    def scan(self, strip: Strip, solid: Obstacle) -> Returned | str:  # noqa: ARG002 - as `Carrier`
        self.strips.append(strip)
        return self.sweep(strip.T_WS)

    def sweep(self, T_WS: FloatArray) -> Returned:
        """Return what the probe measures along poses, in profiles that leave no gap."""
        steps = np.linalg.norm(np.diff(T_WS[:, :3, 3], axis=0), axis=1)
        poses = between(T_WS, max(2, int(steps.sum() / SPACING_MM)))
        numbers = 10_000 * len(self.strips) + np.arange(len(poses))
        seen = measure(self._caster, self._probe, poses, numbers)
        self.coverage.take(poses)
        return Returned(poses, seen.profiles, aligned(poses, seen.profiles, seen.points_S))

    def share(self) -> float:
        """Return the share of the surface that was seen."""
        return self.coverage.shares()[Sight.SEEN]


def between(T_WS: FloatArray, count: int) -> FloatArray:
    """Return `count` poses, evenly along given ones."""
    at, along = np.arange(len(T_WS)), np.linspace(0.0, len(T_WS) - 1.0, count)
    poses = np.tile(np.eye(4), (count, 1, 1))
    poses[:, :3, :3] = Slerp(at, Rotation.from_matrix(T_WS[:, :3, :3]))(along).as_matrix()
    poses[:, :3, 3] = np.column_stack([np.interp(along, at, T_WS[:, axis, 3]) for axis in range(3)])
    return poses
