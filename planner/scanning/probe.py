"""A parametric model of a laser line probe: one laser line, two cameras, no specific product.

Frame S: origin at the laser's exit, +Z along the beam, +X along the line, +Y the scan direction. A point of a profile
is measured under three conditions. The laser's ray meets the surface within the range; its incidence still reflects
light; at least one camera sees the spot. Range is the depth z.
"""

from dataclasses import dataclass
from enum import IntEnum
from typing import NamedTuple

import numpy as np

from planner.arrays import CodeArray, FloatArray, IndexArray
from planner.cell.cell import Probe
from planner.geometry.ray_casting import RayCaster


class Sight(IntEnum):
    """The state of a point of the surface: the first condition that failed, or measured."""

    NEVER_IN_VIEW = 0
    OUT_OF_RANGE = 1
    INCIDENCE = 2
    OCCLUDED = 3
    SEEN = 4


@dataclass(frozen=True)
class LaserProbe:
    """The optics of the probe. The defaults are those of a typical short-range triangulation probe.

    Attributes:
        nearest_mm: depth at the start of the range.
        farthest_mm: depth at the end of the range.
        half_width: half of the line's width over the depth: the tangent of the fan's half-angle.
        points_per_line: points of one profile, with equal spacing on a plane perpendicular to the beam.
        line_rate_hz: maximum profiles per second.
        incidence_limit_deg: maximum angle between beam and normal.
        cameras_mm: positions of the two cameras, in frame S.
        noise_mm: standard deviation of a point along its ray (the paper: 25 micrometers).
    """

    nearest_mm: float = 100.0
    farthest_mm: float = 200.0
    half_width: float = 0.2
    points_per_line: int = 640
    line_rate_hz: float = 100.0
    incidence_limit_deg: float = 65.0
    cameras_mm: tuple[tuple[float, float, float], ...] = ((0.0, 60.0, 0.0), (0.0, -60.0, 0.0))
    noise_mm: float = 0.025

    @classmethod
    def of(cls, probe: Probe) -> "LaserProbe":
        """Return the optics of a cell's probe."""
        return cls(
            nearest_mm=probe.nearest_mm,
            farthest_mm=probe.farthest_mm,
            half_width=0.5 * probe.line_width_mm / probe.stand_off_mm,
        )

    def rays(self) -> FloatArray:
        """Return the directions of the laser fan in frame S, `(points_per_line, 3)`, of length 1."""
        across = np.linspace(-self.half_width, self.half_width, self.points_per_line)
        rays = np.column_stack((across, np.zeros_like(across), np.ones_like(across)))
        return np.asarray(rays / np.linalg.norm(rays, axis=1, keepdims=True))


class Profiles(NamedTuple):
    """The measured points of several profiles, one row each, in the order of the profiles and along each line.

    Attributes:
        profiles: `(m,)` pose index of each point.
        points_S: `(m, 3)` measured position, in frame S.
        rays_S: `(m, 3)` directions of the laser's rays in frame S.
        noise_mm: `(m,)` error of the position along its ray.
        true_W: `(m, 3)` true position, in the frame of the poses.
        normals_W: `(m, 3)` outward normals of the surface there.
    """

    profiles: IndexArray
    points_S: FloatArray
    rays_S: FloatArray
    noise_mm: FloatArray
    true_W: FloatArray
    normals_W: FloatArray


def measure(
    caster: RayCaster,
    probe: LaserProbe,
    T_WS: FloatArray,
    numbers: IndexArray | None = None,
    seed: int = 0,
) -> Profiles:
    """Return the profiles of a surface.

    Args:
        caster: the surface, in frame W.
        probe: the probe.
        T_WS: its poses at the triggers, `(n, 4, 4)` in mm.
        numbers: `(n,)` numbers of the profiles, which determine their noise; default: 0 to n - 1.
        seed: seed of the noise, together with the profile's number: the noise does not depend on other measurements.
    """
    rays_S = probe.rays()
    numbers = np.arange(len(T_WS)) if numbers is None else numbers
    directions = (rays_S @ np.swapaxes(T_WS[:, :3, :3], 1, 2)).reshape(-1, 3)
    origins = np.repeat(T_WS[:, :3, 3], len(rays_S), axis=0)
    hits = caster.first_hits(origins, directions)

    struck = np.flatnonzero(hits.triangles >= 0)
    profile, place = np.divmod(struck, len(rays_S))
    points = origins[struck] + hits.distances_mm[struck, np.newaxis] * directions[struck]
    normals = caster.normals[hits.triangles[struck]]
    depths_mm = hits.distances_mm[struck] * rays_S[place, 2]
    seen = sight(caster, probe, T_WS, profile, points, normals, depths_mm) == Sight.SEEN

    struck, profile, place = struck[seen], profile[seen], place[seen]
    noise_mm = np.stack([_noise(probe, seed, int(number)) for number in numbers]) if len(numbers) else np.zeros((0, 1))
    error_mm = noise_mm[profile, place]
    measured_mm = hits.distances_mm[struck] + error_mm
    rays = rays_S[place]
    return Profiles(profile, measured_mm[:, np.newaxis] * rays, rays, error_mm, points[seen], normals[seen])


def sight(
    caster: RayCaster,
    probe: LaserProbe,
    T_WS: FloatArray,
    profiles: IndexArray,
    points: FloatArray,
    normals: FloatArray,
    depths_mm: FloatArray,
) -> CodeArray:
    """Return the state of each point in the laser line, `(m,)` of `Sight`.

    Args:
        caster: the surface.
        probe: the probe.
        T_WS: poses of the probe, `(n, 4, 4)`.
        profiles: `(m,)` pose index of each point.
        points: `(m, 3)` in frame W.
        normals: `(m, 3)` of the surface there.
        depths_mm: `(m,)` depths z in frame S.
    """
    codes = np.full(len(points), Sight.OUT_OF_RANGE, dtype=np.uint8)
    left = np.flatnonzero((depths_mm >= probe.nearest_mm) & (depths_mm <= probe.farthest_mm))

    codes[left] = Sight.INCIDENCE
    ways = T_WS[profiles[left], :3, 3] - points[left]
    cosines = np.einsum("ij,ij->i", ways, normals[left]) / np.sqrt(np.einsum("ij,ij->i", ways, ways))
    left = left[cosines >= np.cos(np.radians(probe.incidence_limit_deg))]

    codes[left] = Sight.OCCLUDED
    for camera in probe.cameras_mm:
        eyes = T_WS[:, :3, :3] @ np.array(camera) + T_WS[:, :3, 3]
        visible = caster.can_see(points[left], normals[left], eyes[profiles[left]])
        codes[left[visible]] = Sight.SEEN
        left = left[~visible]
    return codes


def _noise(probe: LaserProbe, seed: int, number: int) -> FloatArray:
    """Return the noise of all points of a profile, including those that are not measured."""
    return probe.noise_mm * np.random.default_rng((seed, number)).standard_normal(probe.points_per_line)
