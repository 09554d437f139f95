"""The contribution of each error source to the error of the cloud, found by switching it off.

The profiles of a scan are aligned repeatedly, each time with one source made perfect, or with all but one. The chain of
the table's angle, from the truth to the protocol:

    true angle at the exposure -> [timing] -> at the edge -> [backlash] -> motor -> [encoder] -> count
        -> [rounding] -> wire

The error of each step is the difference of two angles of this table itself, so nothing is assumed about its encoder or
gears. With all sources on, the angle is exactly that of the protocol; with all off, it is exactly the true one.
"""

from collections.abc import Callable, Collection
from dataclasses import dataclass
from enum import StrEnum
from typing import NamedTuple

import numpy as np
import trimesh

from planner.arrays import FloatArray, IndexArray
from planner.scanning.alignment import Calibration, aligned, probe_poses
from planner.scanning.latched_run import LatchedRun
from planner.scanning.probe import Profiles

# Maximum number of points that are used; of a larger cloud at least half as many: their sigma is accurate to 0.5 %.
SAMPLES = 40_000
# trimesh stores all triangles near all points at once, some 25 kB per point on a fine mesh.
_NEAREST_BLOCK = 1000


class Source(StrEnum):
    """An error source."""

    PROBE = "probe noise"
    ROUNDING = "rounding on the wire"
    ENCODER = "encoder"
    BACKLASH = "backlash"
    TIMING = "trigger timing"
    CALIBRATION = "calibration"


TABLE_PARTS = (Source.ROUNDING, Source.ENCODER, Source.BACKLASH)


class Distances(NamedTuple):
    """Signed distances to the surface, outward positive, in mm: `p95` and `greatest` are absolute values."""

    mean: float
    sigma: float
    p95: float
    greatest: float

    @classmethod
    def of(cls, distances_mm: FloatArray) -> "Distances":
        """Return the statistics of some distances."""
        size = np.abs(distances_mm)
        return cls(*map(float, (distances_mm.mean(), distances_mm.std(), np.percentile(size, 95.0), size.max())))


class Contribution(NamedTuple):
    """The contribution of one source, in mm.

    Attributes:
        displacement_mm: root mean square of the displacement of the points by this source alone.
        across_mm: the component perpendicular to the surface, which is measured as distance from it.
        without_mm: the remaining component perpendicular to the surface when only this source is switched off.
    """

    displacement_mm: float
    across_mm: float
    without_mm: float


class Total(NamedTuple):
    """All sources together, in mm; as in `Contribution`."""

    displacement_mm: float
    across_mm: float


@dataclass(frozen=True, eq=False)
class ErrorBudget:
    """The error of a cloud.

    Attributes:
        distances: cloud against mesh, exact, over the samples.
        total: all sources together.
        none_mm: displacement with all of them off: the rest is rounding of the arithmetic.
        parts: each source.
        sum_mm: root of the sum of the squares of the sources, for comparison with `total.displacement_mm`.
        rounding_mm: the rounding error in closed form: a uniform error of one step, times the radius.
        radius_mm: root mean square of the points' distance from the table's axis.
        samples: number of points.
        errors_mm: `(samples,)` signed distance of each.
        points_W: `(samples, 3)` positions of the points.
    """

    distances: Distances
    total: Total
    none_mm: float
    parts: dict[Source, Contribution]
    sum_mm: float
    rounding_mm: float
    radius_mm: float
    samples: int
    errors_mm: FloatArray
    points_W: FloatArray


class Samples:
    """An even selection of a cloud's points with their ground truth, in bounded memory.

    When it is full, every other point is removed, and from then on half as many are taken.
    """

    def __init__(self, most: int = SAMPLES) -> None:
        """Store up to `most` points."""
        self._most, self._every, self._passed = most, 1, 0
        self._kept: list[tuple[IndexArray, Profiles]] = []
        self.count = 0

    def take(self, first_row: int, profiles: Profiles) -> None:
        """Select from the profiles of a block whose first row in the run is `first_row`."""
        order = self._passed + np.arange(len(profiles.profiles))
        self._passed += len(order)
        self._keep(order, profiles._replace(profiles=profiles.profiles + first_row))
        while self.count > self._most:
            self._every *= 2
            kept, self._kept, self.count = self._kept, [], 0
            for each in kept:
                self._keep(*each)

    def _keep(self, order: IndexArray, profiles: Profiles) -> None:
        chosen = order % self._every == 0
        self._kept.append((order[chosen], Profiles._make(part[chosen] for part in profiles)))
        self.count += int(chosen.sum())

    def all(self) -> Profiles:
        """Return the selected points; `profiles` are rows of the run."""
        return Profiles._make(np.concatenate(column) for column in zip(*(each for _, each in self._kept), strict=True))


@dataclass(frozen=True, eq=False)
class Chain:
    """A run with the true and the calibrated placements. It can be aligned with any sources switched off.

    Attributes:
        run: the latched values.
        true: the true placements.
        known: the calibrated placements.
        flange_poses: the arm's forward kinematics, joints (deg) to `(n, 4, 4)`.
    """

    run: LatchedRun
    true: Calibration
    known: Calibration
    flange_poses: Callable[[FloatArray], FloatArray]

    def angles_deg(self, on: Collection[Source]) -> FloatArray:
        """Return the table's angle as latched with some sources of the chain switched on."""
        run = self.run
        angle = run.edge_deg if Source.TIMING in on else run.true_deg
        if run.tells_truth:
            steps = {
                Source.BACKLASH: run.shaft_deg - run.edge_deg,
                Source.ENCODER: run.latched_deg - run.shaft_deg,
                Source.ROUNDING: run.angles_deg - run.latched_deg,
            }
            angle = angle + sum((error for part, error in steps.items() if part in on), np.zeros_like(angle))
        return angle

    def poses(self, on: Collection[Source]) -> FloatArray:
        """Return T_WS `(n, 4, 4)` with some sources switched on."""
        joints = self.run.joints_deg if Source.TIMING in on else self.run.true_joints_deg
        placements = self.known if Source.CALIBRATION in on else self.true
        return probe_poses(placements, self.flange_poses(joints), self.angles_deg(on))


def error_budget_of(chain: Chain, samples: Profiles, mesh: trimesh.Trimesh, wire_step_deg: float) -> ErrorBudget:
    """Return the contribution of each source to the error of a cloud's samples.

    Args:
        chain: the run with its ground truth.
        samples: points of it.
        mesh: the workpiece.
        wire_step_deg: resolution of the protocol.
    """
    everything = frozenset(Source)

    def moved(on: Collection[Source]) -> FloatArray:
        points_S = (
            samples.points_S if Source.PROBE in on else samples.points_S - samples.noise_mm[:, None] * samples.rays_S
        )
        return aligned(chain.poses(on), samples.profiles, points_S) - samples.true_W

    def across_mm(displacement: FloatArray) -> float:
        return _rms(np.einsum("ij,ij->i", displacement, samples.normals_W))

    def contribution(part: Source) -> Contribution:
        alone = moved({part})
        return Contribution(_rms(alone, 3), across_mm(alone), across_mm(moved(everything - {part})))

    together, none = moved(everything), moved(())
    parts = {part: contribution(part) for part in Source if chain.run.tells_truth or part not in TABLE_PARTS}
    points_W = samples.true_W + together
    errors_mm = signed_distances_mm(mesh, points_W)
    T_TW = chain.true.T_TW
    radii_mm = np.hypot(*(samples.true_W @ T_TW[:2, :3].T + T_TW[:2, 3]).T)
    radius_mm = _rms(radii_mm)
    return ErrorBudget(
        distances=Distances.of(errors_mm),
        total=Total(_rms(together, 3), across_mm(together)),
        none_mm=_rms(none, 3),
        parts=parts,
        sum_mm=float(np.sqrt(sum(part.displacement_mm**2 for part in parts.values()))),
        rounding_mm=float(np.radians(wire_step_deg / np.sqrt(12.0)) * radius_mm),
        radius_mm=radius_mm,
        samples=len(errors_mm),
        errors_mm=errors_mm,
        points_W=points_W,
    )


def signed_distances_mm(mesh: trimesh.Trimesh, points: FloatArray) -> FloatArray:
    """Return the distance `(n,)` of each point `(n, 3)` from the nearest point of a surface, outside positive."""
    signed = np.empty(len(points))
    normals = np.asarray(mesh.face_normals)
    for first in range(0, len(points), _NEAREST_BLOCK):
        block = slice(first, first + _NEAREST_BLOCK)
        nearest, distances_mm, triangles = mesh.nearest.on_surface(points[block])
        outward = np.einsum("ij,ij->i", points[block] - nearest, normals[triangles])
        signed[block] = np.copysign(distances_mm, outward)
    return signed


def _rms(values: FloatArray, dimensions: int = 1) -> float:
    """Return the root mean square of values, or of the lengths of vectors; 0 for an empty array."""
    return float(np.sqrt(dimensions * np.mean(np.square(values)))) if values.size else 0.0
