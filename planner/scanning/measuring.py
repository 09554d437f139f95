"""What the simulated probe measures in one run after another: one cloud, its coverage, and samples of its error."""

from typing import NamedTuple

import numpy as np
import trimesh

from planner.arrays import FloatArray, IndexArray
from planner.geometry.ray_casting import RayCaster
from planner.geometry.thinned_cloud import ThinnedCloud
from planner.scanning.alignment import aligned, probe_poses
from planner.scanning.coverage import Coverage
from planner.scanning.error_budget import Chain, Samples
from planner.scanning.point_cloud import PlyWriter, XyzWriter
from planner.scanning.probe import LaserProbe, measure
from protocol.program.progress import Progress

# Profiles that are measured at once: some 40 000 points.
_BLOCK = 64
# Profiles that are nearer to one another leave no gap.
COVERED_MM = 2.0


class Measured(NamedTuple):
    """What the probe returned in one run, as far as it came.

    Attributes:
        T_WS: `(n, 4, 4)` poses of the probe, from what was latched and calibrated alone.
        profiles: `(m,)` the profile of each point, an index into `T_WS`.
        points_W: `(m, 3)` in mm.
        is_whole: Whether it came to its end before Ctrl-C.
    """

    T_WS: FloatArray
    profiles: IndexArray
    points_W: FloatArray
    is_whole: bool


class Measuring:
    """The profiles of a scan's runs, block by block, from the probe to the cloud.

    Attributes:
        samples: Points of all runs with what is true of them; their profiles are rows of the runs joined.
        coverage: What was seen of the surface.
        thinned: The thinned cloud, if it was asked for.
        rows: How many profiles were taken in.
    """

    def __init__(self, mesh: trimesh.Trimesh, probe: LaserProbe, seed: int, thinned_mm: float | None = None) -> None:
        """Begin a cloud of a mesh in mm, thinned to cells of `thinned_mm` beside if that is given."""
        self.samples = Samples()
        self.thinned = None if thinned_mm is None else ThinnedCloud(thinned_mm)
        self.rows = 0
        caster = RayCaster(mesh)
        self.coverage = Coverage(mesh, caster, probe, COVERED_MM)
        self._caster, self._probe, self._seed = caster, probe, seed

    def take(self, chain: Chain, ply: PlyWriter, xyz: XyzWriter | None, progress: Progress | None) -> Measured:
        """Measure, align and write the profiles of a run."""
        total = len(chain.run.numbers)
        true_T_WS, known_T_WS = chain.poses(()), known_poses(chain)
        parts: list[tuple[IndexArray, FloatArray]] = []
        done = 0
        try:
            for first in range(0, total, _BLOCK):
                block = slice(first, first + _BLOCK)
                numbers = chain.run.numbers[block]
                seen, points = self._measure(numbers, true_T_WS[block], known_T_WS[block], ply, xyz)
                parts.append((seen + first, points))
                done = min(first + _BLOCK, total)
                if progress is not None:
                    progress(done, total)
        except KeyboardInterrupt:
            pass
        self.rows += total - done  # rows of the run that were not measured stay without samples
        profiles = np.concatenate([np.zeros(0, dtype=np.int64), *(each for each, _ in parts)])
        points = np.concatenate([np.zeros((0, 3)), *(each for _, each in parts)])
        return Measured(known_T_WS[:done], profiles, points, done == total)

    def _measure(
        self,
        numbers: IndexArray,
        true_T_WS: FloatArray,
        known_T_WS: FloatArray,
        ply: PlyWriter,
        xyz: XyzWriter | None,
    ) -> tuple[IndexArray, FloatArray]:
        seen = measure(self._caster, self._probe, true_T_WS, numbers, self._seed)
        points = aligned(known_T_WS, seen.profiles, seen.points_S)
        beams = np.einsum("ijk,ik->ij", known_T_WS[seen.profiles, :3, :3], seen.rays_S)
        ply.write(points, beams, numbers[seen.profiles])
        if xyz is not None:
            xyz.write(points)
        if self.thinned is not None:
            self.thinned.take(points, beams)
        self.samples.take(self.rows, seen)
        self.coverage.take(true_T_WS)
        self.rows += len(numbers)
        return seen.profiles, points


def known_poses(chain: Chain) -> FloatArray:
    """Return T_WS `(n, 4, 4)` of a run's profiles from what was latched and calibrated alone."""
    return probe_poses(chain.known, chain.flange_poses(chain.run.joints_deg), chain.run.angles_deg)
