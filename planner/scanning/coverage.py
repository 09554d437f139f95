"""The share of the surface that a scan measured, and the reasons for the rest.

Each profile is tested for points that are spread evenly over the surface: whether the laser's fan passes over the
point, and whether the probe would measure it. The conditions are those of the probe (`probe.sight`), so the result
belongs to the scan, not to the density of the cloud. A point that was never measured keeps the last condition that it
reached.
"""

import numpy as np
import trimesh

from planner.arrays import CodeArray, FloatArray, IndexArray
from planner.geometry.ray_casting import RayCaster
from planner.geometry.transforms import rigid_inverse
from planner.scanning.probe import LaserProbe, Sight, sight

SAMPLES = 5000

REASONS = {
    Sight.NEVER_IN_VIEW: "never in view: no profile passes over it on its side of the part",
    Sight.OUT_OF_RANGE: "out of reach: nearer or farther than the probe's range",
    Sight.INCIDENCE: "incidence: the beam meets it too flat",
    Sight.OCCLUDED: "occluded: the part is in the way of the laser or of both cameras",
}


class Coverage:
    """The sample points of the surface, and the best condition that each has reached.

    Attributes:
        points: `(SAMPLES, 3)` in frame W.
        normals: `(SAMPLES, 3)`.
        codes: `(SAMPLES,)` of `Sight`.
    """

    def __init__(self, mesh: trimesh.Trimesh, caster: RayCaster, probe: LaserProbe, spacing_mm: float) -> None:
        """Distribute the samples over a mesh.

        Args:
            mesh: the surface.
            caster: the same surface, for ray casting.
            probe: the probe.
            spacing_mm: maximum distance of profiles without a gap between them.
        """
        points, triangles = trimesh.sample.sample_surface(mesh, SAMPLES, seed=0)
        self.points: FloatArray = np.asarray(points, dtype=np.float64)
        self.normals: FloatArray = caster.normals[triangles]
        self.codes: CodeArray = np.full(SAMPLES, Sight.NEVER_IN_VIEW, dtype=np.uint8)
        self._caster, self._probe, self._spacing_mm = caster, probe, spacing_mm

    def take(self, T_WS: FloatArray) -> None:
        """Add profiles from poses `(n, 4, 4)`."""
        unseen = np.flatnonzero(self.codes != Sight.SEEN)
        if not len(unseen):
            return
        profile, place, depths_mm = self._passed_over(T_WS, self.points[unseen])
        sample = unseen[place]
        points, normals, eyes = self.points[sample], self.normals[sample], T_WS[profile, :3, 3]
        facing = np.einsum("ij,ij->i", eyes - points, normals) > 0.0
        profile, sample, depths_mm, eyes = profile[facing], sample[facing], depths_mm[facing], eyes[facing]
        points, normals = points[facing], normals[facing]
        codes = sight(self._caster, self._probe, T_WS, profile, points, normals, depths_mm)
        struck = np.flatnonzero(codes == Sight.SEEN)
        hidden = ~self._caster.can_see(points[struck], normals[struck], eyes[struck])
        codes[struck[hidden]] = Sight.OCCLUDED
        np.maximum.at(self.codes, sample, codes)

    def _passed_over(self, T_WS: FloatArray, points: FloatArray) -> tuple[IndexArray, IndexArray, FloatArray]:
        """Return the pairs of profiles and points (indices) with a crossing, and its depth."""
        T_SW = rigid_inverse(T_WS)
        across = points @ T_SW[:, 1, :3].T + T_SW[:, 1, 3]  # y in frame S, (m, n)
        place, profile = np.nonzero(np.abs(across) <= 0.5 * self._spacing_mm)
        in_S = np.einsum("ijk,ik->ij", T_SW[profile, :3, :3], points[place]) + T_SW[profile, :3, 3]
        within = (in_S[:, 2] > 0.0) & (np.abs(in_S[:, 0]) <= self._probe.half_width * in_S[:, 2])
        return profile[within], place[within], in_S[within, 2]

    def shares(self) -> dict[Sight, float]:
        """Return the share of the surface in each state; their sum is 1."""
        return {code: float(np.mean(self.codes == code)) for code in Sight}
