"""The policy for a part whose mesh is known: candidates over what was not seen, and the fewest that see it.

What can be seen is not assumed: it is what was seen, and what any candidate that the arm can reach would see. Where
places are left that no candidate sees, more candidates are made for these, from more directions, before they are given
up.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import trimesh

from planner.adaptive.candidates import POSES, candidate_sweeps
from planner.adaptive.choice import choose
from planner.adaptive.policy import PolicyError, Returned
from planner.adaptive.reach import allowed, filled_up, reach, trimmed, usable
from planner.adaptive.strip import Strip
from planner.adaptive.surroundings import Surroundings
from planner.adaptive.visibility import Places, sees
from planner.arrays import BoolArray, FloatArray
from planner.cell.obstacles import Obstacle
from planner.cell.scan_path import ScanPath
from planner.geometry.ray_casting import RayCaster
from planner.scanning.coverage import Coverage
from planner.scanning.error_budget import signed_distances_mm
from planner.scanning.measuring import COVERED_MM
from planner.scanning.probe import LaserProbe, Sight
from protocol.program.progress import Progress

# A strip of fewer poses is not worth the way to it.
_FEWEST_POSES = 3
# Rounds of candidates: places over which strips are laid, and directions for each. The later ones are for what no
# candidate of those before sees.
_ROUNDS = ((250, 7), (100, 24), (50, 24))
# A cloud fits its mesh where few of its points lie farther off than this; so many are looked at.
_FITS_MM = 1.0
_MISFITS = 0.05
_LOOKED_AT = 400


@dataclass(frozen=True, eq=False)
class Candidates:
    """Strips that the arm can reach, and what each sees.

    Attributes:
        strips: `n` strips.
        sees: `(n, m)` which places each sees.
    """

    strips: tuple[FloatArray, ...]
    sees: BoolArray


class KnownPart:
    """Chooses strips with the part's mesh at hand.

    Attributes:
        coverage: What was seen, from the poses that were latched.
    """

    def __init__(
        self,
        surroundings: Surroundings,
        mesh: trimesh.Trimesh,
        solid: Obstacle,
        probe: LaserProbe,
        share: float,
        most: int,
        speed_mm_s: float,
        progress: Progress | None = None,
    ) -> None:
        """Begin with nothing seen.

        Args:
            surroundings: The cell.
            mesh: The part in frame W, in mm.
            solid: The same as an obstacle.
            probe: The probe's optics.
            share: Of what can be seen, that is wanted; above 0, up to 1.
            most: How many strips may be chosen.
            speed_mm_s: How fast strips are swept.
            progress: Called while candidates are made.
        """
        self._surroundings, self._mesh, self._solid, self._probe = surroundings, mesh, solid, probe
        self._share, self._left, self._speed_mm_s, self._progress = share, most, speed_mm_s, progress
        self._caster = RayCaster(mesh)
        self.coverage = Coverage(mesh, self._caster, probe, COVERED_MM)
        self._places = Places(self.coverage.points, self.coverage.normals)
        self._candidates: Candidates | None = None
        self._is_open: BoolArray = np.zeros(0, dtype=np.bool_)
        self._is_scanned: BoolArray = np.zeros(0, dtype=np.bool_)
        self._numbers: dict[str, int] = {}

    @property
    def seen(self) -> BoolArray:
        """`(m,)` which places were seen."""
        return np.asarray(self.coverage.codes == Sight.SEEN)

    @property
    def visible(self) -> BoolArray:
        """`(m,)` which places can be seen: those seen, and those that any candidate sees."""
        return np.asarray(self.seen | self.sees.any(axis=0))

    @property
    def sees(self) -> BoolArray:
        """`(n, m)` which of the candidates see which places; none before strips were asked for.

        Those that were scanned are left out: what they see is known. One that could not be carried out still counts.
        """
        if self._candidates is None:
            return np.zeros((0, len(self._places.points)), dtype=np.bool_)
        return self._candidates.sees[~self._is_scanned]

    @property
    def has_looked(self) -> bool:
        """Whether it was asked for strips, and so has computed what can be seen."""
        return self._candidates is not None

    @property
    def wanted(self) -> int:
        """How many places are to be seen in the end."""
        return int(np.ceil(self._share * self.visible.sum() - 1e-9))

    def next_strips(self) -> Sequence[Strip]:
        """Return the fewest strips that are needed, the most useful first."""
        if self._candidates is None:
            self._candidates = self._made()
            self._is_open = np.ones(len(self._candidates.strips), dtype=np.bool_)
            self._is_scanned = ~self._is_open
        if not self.visible.any():
            raise PolicyError(f"{self._surroundings.name}: nothing of the part can be reached; {_NEXT_STEP}")
        if int(self.seen.sum()) >= self.wanted:
            return []
        still = np.flatnonzero(self._is_open)
        chosen = choose(self._candidates.sees[still], self.seen, self.wanted, self._left)
        return [self._strip(int(still[number])) for number in chosen]

    def take(self, strip: Strip | None, returned: Returned) -> None:
        """Take in the poses of a path, and refuse points that do not lie on the mesh."""
        self.coverage.take(returned.T_WS)
        if strip is not None:
            self._left -= 1
            self._close(strip)
            self._is_scanned[self._numbers[strip.name]] = True
        self._check_fit(strip, returned.points_W)

    def refuse(self, strip: Strip, reason: str) -> None:  # noqa: ARG002 - any reason closes it
        """Give a candidate up."""
        self._close(strip)

    def solid(self) -> Obstacle:
        """Return the part."""
        return self._solid

    def state(self) -> str:
        """Return the share of what can be seen."""
        if self._candidates is None:
            return f"{self.seen.mean():.1%} of the surface"
        return f"{self.seen.sum() / max(1, self.visible.sum()):.1%} of what can be seen"

    def _strip(self, number: int) -> Strip:
        assert self._candidates is not None
        T_WS = self._candidates.strips[number]
        length_mm = float(np.linalg.norm(np.diff(T_WS[:, :3, 3], axis=0), axis=1).max())
        strip = Strip(f"candidate {number}", ScanPath(T_WS, length_mm / self._speed_mm_s))
        self._numbers[strip.name] = number
        return strip

    def _close(self, strip: Strip) -> None:
        self._is_open[self._numbers[strip.name]] = False

    def _check_fit(self, strip: Strip | None, points_W: FloatArray) -> None:
        if not len(points_W):
            return
        looked_at = points_W[:: max(1, len(points_W) // _LOOKED_AT)]
        off = float(np.mean(np.abs(signed_distances_mm(self._mesh, looked_at)) > _FITS_MM))
        if off > _MISFITS:
            where = "the predefined path" if strip is None else strip.name
            raise PolicyError(
                f"{self._surroundings.name}: the cloud does not fit the mesh: {off:.0%} of the points of {where} are"
                f" more than {_FITS_MM:g} mm from it, allowed are {_MISFITS:.0%}; check part, unit and placement, or"
                " scan with --blind"
            )

    def _made(self) -> Candidates:
        """Return the candidates over what was not seen."""
        made = Candidates((), np.zeros((0, len(self._places.points)), dtype=np.bool_))
        for number, (targets, directions) in enumerate(_ROUNDS):
            if self._progress is not None:
                self._progress(number, len(_ROUNDS))
            missing = ~(self.seen | made.sees.any(axis=0))
            if missing.any():
                more = self._round(missing, targets, directions)
                made = Candidates(made.strips + more.strips, np.concatenate((made.sees, more.sees)))
        if self._progress is not None:
            self._progress(len(_ROUNDS), len(_ROUNDS))
        return made

    def _round(self, missing: BoolArray, targets: int, directions: int) -> Candidates:
        """Return candidates over places that are missing."""

        def is_reached(T_WS: FloatArray) -> BoolArray:
            return np.asarray(allowed(self._surroundings, self._solid, T_WS).any(axis=(0, 2)))

        nothing = Candidates((), np.zeros((0, len(self._places.points)), dtype=np.bool_))
        cell = self._surroundings.cell
        longest_mm = float(np.max(self._mesh.extents))
        strips = candidate_sweeps(
            self._caster, self._places.only(missing), targets, directions, longest_mm, cell.probe, is_reached
        )
        if not len(strips):
            return nothing
        poses = strips.reshape(-1, 4, 4)
        at_angles = allowed(self._surroundings, self._solid, poses).reshape(8, len(strips), POSES, -1)
        found = reach(at_angles, turn_samples=1)
        kept = usable(found, _FEWEST_POSES)
        whole = trimmed(strips, found)
        swept = [whole[k] for k in kept]
        if not swept:
            return nothing
        seen = sees(self._caster, self._probe, *filled_up(swept, POSES), self._places)
        useful = (seen & ~self.seen).any(axis=1)
        return Candidates(tuple(swept[k] for k in np.flatnonzero(useful)), seen[useful])


_NEXT_STEP = "move the part on the table, or change probe or arm (python -m planner map states the reasons of a path)"
