"""How much of the surface a scan has seen, and why not the rest.

Points spread evenly over the surface are asked of each profile: does the laser's fan pass over it, and would it be
measured there? The conditions are the probe's own (`probe.sight`), so the answer is that of the scan, not of the
cloud's density. A point that was never measured keeps the condition that it came nearest to meeting all of.
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
    """The surface's sample points, and how far each came to being measured so far.

    Attributes:
        points: `(SAMPLES, 3)` in frame W.
        normals: `(SAMPLES, 3)`.
        codes: `(SAMPLES,)` of `Sight`.
    """

    def __init__(self, mesh: trimesh.Trimesh, caster: RayCaster, probe: LaserProbe, spacing_mm: float) -> None:
        """Spread the samples over a mesh.

        Args:
            mesh: The surface.
            caster: The same, for rays.
            probe: The probe.
            spacing_mm: Profiles nearer to one another than this leave no gap between them.
        """
        points, triangles = trimesh.sample.sample_surface(mesh, SAMPLES, seed=0)
        self.points: FloatArray = np.asarray(points, dtype=np.float64)
        self.normals: FloatArray = caster.normals[triangles]
        self.codes: CodeArray = np.full(SAMPLES, Sight.NEVER_IN_VIEW, dtype=np.uint8)
        self._caster, self._probe, self._spacing_mm = caster, probe, spacing_mm

    def take(self, T_WS: FloatArray) -> None:
        """Take in profiles from poses `(n, 4, 4)`."""
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
        """Return which profiles pass over which points (indices), and at what depth."""
        T_SW = rigid_inverse(T_WS)
        across = points @ T_SW[:, 1, :3].T + T_SW[:, 1, 3]  # y in frame S, (m, n)
        place, profile = np.nonzero(np.abs(across) <= 0.5 * self._spacing_mm)
        in_S = np.einsum("ijk,ik->ij", T_SW[profile, :3, :3], points[place]) + T_SW[profile, :3, 3]
        within = (in_S[:, 2] > 0.0) & (np.abs(in_S[:, 0]) <= self._probe.half_width * in_S[:, 2])
        return profile[within], place[within], in_S[within, 2]

    def shares(self) -> dict[Sight, float]:
        """Return the share of the surface in each state; together they are 1."""
        return {code: float(np.mean(self.codes == code)) for code in Sight}
