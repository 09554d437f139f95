"""The policy without a mesh: look beyond the edges of what was seen, past space that counts as solid until seen.

It is given the cell, the probe, a bounding cylinder, and what the probe returned. It sees no mesh: none of its
arguments has one.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from planner.adaptive.candidates import POSES, directions, following, spread, sweeps
from planner.adaptive.guessed_places import guesses
from planner.adaptive.policy import PolicyError, Returned
from planner.adaptive.reach import ANGLES, allowed, filled_up, reach, trimmed, usable
from planner.adaptive.seen_surface import Estimate
from planner.adaptive.strip import Strip
from planner.adaptive.surroundings import Surroundings
from planner.adaptive.visibility import sees
from planner.adaptive.voxel_map import VoxelMap
from planner.arrays import FloatArray, IndexArray
from planner.cell.obstacles import Obstacle
from planner.cell.patterns import StripLayout, cylinder_rings
from planner.cell.scan import Scan, check_it_fits_the_table
from planner.cell.scan_path import ScanPath, at_scan_speed
from planner.cell.workpiece import Cylinder
from planner.errors import WorkpieceError
from planner.geometry.box_distance import FIELD
from planner.geometry.thinned_cloud import ThinnedCloud
from planner.scanning.probe import LaserProbe

_VOXEL_MM, _CELL_MM = 3.0, 2.0
_BEYOND_MM = 0.5
"""How far a point may lie beyond the bounding cylinder: noise, and errors of the alignment."""
_SURVEY_GAP_MM = 25.0
"""How far the cylinder is beyond the beginning of the range in the survey."""
_SURVEY_STEP_S = 0.5
_TARGETS, _WAYS_EACH = 60, 8
_ROLLS_DEG = (0.0, 90.0)
_LENGTH_MM = 60.0
_FEWEST_POSES = 3
_BATCH = 2
"""Strips that are chosen at once."""
_TRIED_FIRST = 200
"""Candidates whose reach is looked for at once, those that are worth most first."""
_LEAST_WORTH = 3.0
"""What a strip has to be worth, in guesses."""
_KEPT, _MOST_TRIES = 0.25, 15
"""What a guess keeps of its worth with each strip that should have seen it and did not."""


def survey(scan: Scan, bounds: Cylinder, speed_mm_s: float) -> Scan:
    """Return the scan of a bounding cylinder instead of the part: rings, near enough to see far into it.

    Args:
        scan: The cell and its limits; its workpiece and its path are left out.
        bounds: The cylinder, in frame W.
        speed_mm_s: How fast the laser line moves over the cylinder.

    Raises:
        WorkpieceError: The cylinder reaches beyond the table.
    """
    mesh = bounds.mesh()
    try:
        check_it_fits_the_table(mesh, scan.cell)
    except WorkpieceError as error:
        raise WorkpieceError(f"the bounding cylinder does not fit the table: {error}") from error
    probe = replace(scan.cell.probe, stand_off_mm=scan.cell.probe.nearest_mm + _SURVEY_GAP_MM)
    waypoints = cylinder_rings(bounds, probe, StripLayout())
    path = at_scan_speed(waypoints, speed_mm_s, _SURVEY_STEP_S, probe.stand_off_mm, probe.line_width_mm)
    cell = replace(scan.cell, probe=probe)
    return replace(scan, cell=cell, workpiece=bounds, mesh=mesh, mesh_file=None, predefined_path=path)


class UnknownPart:
    """Chooses strips from what the probe returned alone."""

    def __init__(self, surroundings: Surroundings, probe: LaserProbe, bounds: Cylinder, speed_mm_s: float) -> None:
        """Begin with nothing seen inside the cylinder.

        Args:
            surroundings: The cell.
            probe: What can be measured.
            bounds: A cylinder in frame W that holds the part.
            speed_mm_s: How fast strips are swept.
        """
        self._step_s = _LENGTH_MM / (POSES - 1) / speed_mm_s
        self._surroundings, self._probe, self._bounds = surroundings, probe, bounds
        self._voxels = VoxelMap(bounds, _VOXEL_MM)
        self._cloud = ThinnedCloud(_CELL_MM)
        self._tries = np.zeros(self._voxels.states.shape, dtype=np.uint8)
        self._estimate = Estimate(self._cloud)
        self._guesses = guesses(self._estimate, self._voxels, bounds.middle_mm[2])
        self._count = 0
        self._solid: Obstacle | None = None

    def take(self, strip: Strip | None, returned: Returned) -> None:
        """Take in what the probe returned; see `Policy`.

        Raises:
            PolicyError: There is surface beyond the bounding cylinder.
        """
        origins = returned.T_WS[returned.profiles, :3, 3]
        ways = returned.points_W - origins
        self._solid = None
        self._voxels.take(origins, returned.points_W)
        self._cloud.take(returned.points_W, ways / np.linalg.norm(ways, axis=1, keepdims=True))
        if strip is not None:
            self._note(strip)
        self._check_bounds(returned.points_W)

    def refuse(self, strip: Strip, reason: str) -> None:  # noqa: ARG002 - any reason is taken the same
        """Learn that a strip cannot be carried out; see `Policy`."""
        self._note(strip)

    def solid(self) -> Obstacle:
        """Return the space that was not seen to be free; light passes it."""
        if self._solid is None:
            T_TW, field = self._surroundings.cell.T_TW, self._voxels.field()
            self._solid = Obstacle("unseen space", FIELD, np.zeros(3), T_TW, True, field, stops_light=False)
        return self._solid

    def state(self) -> str:
        """Return the area that was seen."""
        return f"{len(self._cloud.points) * _CELL_MM**2 / 100.0:.0f} cm² seen"

    def next_strips(self) -> Sequence[Strip]:
        """Return the strips that are worth most; see `Policy`."""
        self._estimate = Estimate(self._cloud)
        self._guesses = guesses(self._estimate, self._voxels, self._bounds.middle_mm[2])
        weights = self._weights()
        if not weights.any():
            return ()
        candidates = self._candidates(weights)
        if not len(candidates):
            return ()
        last = np.full(len(candidates), candidates.shape[1] - 1)
        worth = sees(self._estimate.caster, self._probe, candidates, last, self._guesses.places) @ weights
        order = np.argsort(-worth, kind="stable")
        order = order[worth[order] >= _LEAST_WORTH]
        for first in range(0, len(order), _TRIED_FIRST):
            chosen = self._chosen(candidates[order[first : first + _TRIED_FIRST]], weights)
            if chosen:
                return chosen
        return ()

    def _weights(self) -> FloatArray:
        """Return what each guess is still worth."""
        cells, inside = self._voxels.cells(self._guesses.places.points)
        tries = np.zeros(len(cells), dtype=np.int64)
        tries[inside] = self._tries[tuple(cells[inside].T)]
        return np.asarray(self._guesses.weights * _KEPT**tries)

    def _candidates(self, weights: FloatArray) -> FloatArray:
        """Return strips `(n, k, 4, 4)` over the guesses that are worth most."""
        places, probe = self._guesses.places, self._surroundings.cell.probe
        worthy = np.argsort(-weights, kind="stable")[: 8 * _TARGETS]
        worthy = worthy[weights[worthy] > 0.25 * weights.max()]
        targets = places.only(worthy[spread(places.points[worthy], _TARGETS)])
        number, ways = _few_each(*directions(self._estimate.caster, targets, probe.stand_off_mm))
        if not len(number):
            return np.empty((0, POSES, 4, 4))
        rolls = np.repeat(_ROLLS_DEG, len(number))
        number, ways = np.tile(number, len(_ROLLS_DEG)), np.tile(ways, (len(_ROLLS_DEG), 1))
        straight = sweeps(targets.points[number], ways, rolls, _LENGTH_MM, probe)
        moved, much = following(self._estimate.caster, straight, probe)
        return np.concatenate((straight, moved[much]))

    def _chosen(self, candidates: FloatArray, weights: FloatArray) -> list[Strip]:
        """Return up to a batch of strips that the arm can sweep, the next always worth more than any other."""
        n, k = candidates.shape[:2]
        poses = allowed(self._surroundings, self.solid(), candidates.reshape(-1, 4, 4))
        turn = int(self._surroundings.limits.speed_deg_s * self._step_s / (360.0 / ANGLES))
        found = reach(poses.reshape(len(poses), n, k, -1), turn)
        swept = trimmed(candidates, found)
        strips = [swept[number] for number in usable(found, _FEWEST_POSES)]
        if not strips:
            return []
        seen = sees(self._estimate.caster, self._probe, *filled_up(strips, k), self._guesses.places)
        left, chosen = weights.copy(), []
        for _ in range(_BATCH):
            worth = seen @ left
            best = int(worth.argmax())
            if worth[best] < _LEAST_WORTH:
                break
            self._count += 1
            chosen.append(Strip(f"strip {self._count}", ScanPath(strips[best], self._step_s)))
            left[seen[best]] = 0.0
        return chosen

    def _note(self, strip: Strip) -> None:
        """Lower what the guesses are worth that a strip should have seen."""
        last = np.array([len(strip.T_WS) - 1])
        seen = sees(self._estimate.caster, self._probe, strip.T_WS[np.newaxis], last, self._guesses.places)[0]
        cells, inside = self._voxels.cells(self._guesses.places.points[seen])
        at = tuple(np.unique(cells[inside], axis=0).T)
        self._tries[at] = np.minimum(self._tries[at] + 1, _MOST_TRIES)

    def _check_bounds(self, points: FloatArray) -> None:
        """Refuse surface beyond the bounding cylinder.

        Raises:
            PolicyError: There is some.
        """
        bounds = self._bounds
        x, y, z = (points - bounds.middle_mm).T
        aside_mm = float(np.hypot(x, y).max(initial=0.0)) - 0.5 * bounds.diameter_mm
        above_mm = float(z.max(initial=0.0)) - bounds.height_mm
        below_mm = -float(z.min(initial=0.0))
        beyond_mm, side = max((aside_mm, "beside"), (above_mm, "above"), (below_mm, "below"))
        if beyond_mm > _BEYOND_MM:
            raise PolicyError(
                f"the probe sees surface {beyond_mm:.1f} mm {side} the bounding cylinder of {bounds.diameter_mm:g} x"
                f" {bounds.height_mm:g} mm, which stands on z = 0; give a larger one, or move the part"
            )


def _few_each(number: IndexArray, ways: FloatArray) -> tuple[IndexArray, FloatArray]:
    """Return of each target's directions a few that lie far apart; the numbers `(m,)` of the targets are ascending."""
    groups = np.split(np.arange(len(number)), np.flatnonzero(np.diff(number)) + 1)
    kept = np.concatenate([group[spread(ways[group], _WAYS_EACH)] for group in groups])
    return number[kept], ways[kept]
