"""A session of adaptive scanning from end to end: the predefined path if there is one, then strip after strip."""

from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import NamedTuple

import numpy as np

from planner.adaptive.known_part import KnownPart
from planner.adaptive.policy import Policy, PolicyError, Returned
from planner.adaptive.session import Session, run_session
from planner.adaptive.surroundings import Surroundings
from planner.adaptive.table_carrier import ScannedStrip, TableCarrier
from planner.adaptive.transfer import Transfer
from planner.adaptive.unknown_part import UnknownPart, survey
from planner.adaptive.unseen_regions import Region, unseen_regions
from planner.adaptive.visibility import Places, at_nearest
from planner.arrays import BoolArray, IndexArray
from planner.cell.obstacles import workpiece_obstacle
from planner.cell.scan import Scan
from planner.cell.workpiece import Cylinder
from planner.defaults import MOST_STRIPS, SHARE_SEEN
from planner.execution.dead_line import DeadLine, judge_dead_line
from planner.execution.run_input import RunInput
from planner.scanning.latched_run import LatchedRun, joined, number_after, numbered_from
from planner.scanning.measuring import COVERED_MM, Measuring
from planner.scanning.point_cloud import PlyWriter, XyzWriter
from planner.scanning.probe import LaserProbe, Sight
from planner.scanning.scan_run import (
    CLOUD_FILE,
    XYZ_FILE,
    Knowledge,
    ScanError,
    Scanned,
    ScanOptions,
    chain_of,
    check_motion,
    cloud_files,
    finished,
    planned_scan,
    probe_of,
    table_at_port,
)
from protocol.program.progress import ProgressOf

# Distance of a strip's profiles, as a share of the largest distance without a gap: one profile may be missing.
_DENSITY = 0.4


class AdaptOptions(NamedTuple):
    """What a session is for.

    Attributes:
        share: Of what can be seen, that is wanted; 0 to scan what is found, where the mesh is not known.
        most_strips: How many strips are scanned at most.
        bounds: A cylinder that holds the part, in frame W: the strips are chosen without the mesh. None to use it.
    """

    share: float = SHARE_SEEN
    most_strips: int = MOST_STRIPS
    bounds: Cylinder | None = None


@dataclass(frozen=True, eq=False)
class AdaptiveScanned:
    """What a session came to.

    Attributes:
        scanned: The cloud, as that of any scan.
        session: The strips that were tried, in their order.
        strips: Those that were scanned.
        path: The predefined path; None where there was none.
        draws_back: The way to a clear posture at the end.
        adapt: What was wanted.
        visible: `(m,)` which places of the coverage can be seen; all where that is not known.
        knows_visible: Whether what can be seen was computed: not where the session ended before that.
        first_seen: `(m,)` the motion that saw each place first, counted from 0, the path included; -1 for none.
        regions: What was not seen.
    """

    scanned: Scanned
    session: Session
    strips: tuple[ScannedStrip, ...]
    path: RunInput | None
    draws_back: Transfer | None
    adapt: AdaptOptions
    visible: BoolArray
    knows_visible: bool
    first_seen: IndexArray
    regions: list[Region]

    @property
    def places(self) -> int:
        """How many places the surface is known by."""
        return len(self.visible)

    @property
    def seen_after(self) -> list[int]:
        """How many places were seen after each motion, the path included."""
        motions = len(self.strips) + (self.path is not None)
        new = np.bincount(self.first_seen[self.first_seen >= 0], minlength=motions)
        return [int(seen) for seen in np.cumsum(new)]

    @property
    def share_of_whole(self) -> float:
        """Of the whole surface, what was seen."""
        return self.seen_after[-1] / self.places

    @property
    def share_of_visible(self) -> float:
        """Of what can be seen, what was seen."""
        return self.seen_after[-1] / max(1, int(self.visible.sum()))

    @property
    def has_wanted_share(self) -> bool:
        """Whether the wanted share was seen."""
        return self.share_of_visible >= self.adapt.share - 1e-9

    @property
    def has_succeeded(self) -> bool:
        """Whether the wanted share was seen, and every strip was verified."""
        return (
            self.scanned.is_whole
            and self.session.failure is None
            and self.knows_visible
            and self.has_wanted_share
            and all(strip.verification.is_verified for strip in self.strips)
        )

    @property
    def duration_s(self) -> float:
        """How long the session takes: path, strips, the ways between them, and drawing back."""
        path_s = 0.0 if self.path is None else self.path.motion().end_s - self.path.motion().start_s
        back_s = 0.0 if self.draws_back is None else self.draws_back.duration_s
        return path_s + sum(strip.duration_s for strip in self.strips) + back_s


@dataclass
class _Cloud:
    """The cloud of a session as it grows."""

    scan: Scan
    knowledge: Knowledge
    work: Measuring
    ply: PlyWriter
    xyz: XyzWriter | None
    runs: list[LatchedRun] = field(default_factory=list)
    dead_lines: list[DeadLine] = field(default_factory=list)
    first_seen: IndexArray = field(init=False)

    def __post_init__(self) -> None:
        self.first_seen = np.full(len(self.work.coverage.codes), -1, dtype=np.int64)

    def take(self, planned: RunInput, run: LatchedRun) -> Returned:
        """Measure, align and write a run."""
        first = number_after(self.runs[-1]) if self.runs else 0
        self.runs.append(numbered_from(run, first))
        self.dead_lines.append(judge_dead_line(planned.problem.map, planned.motion(), run.record))
        measured = self.work.take(chain_of(self.scan, self.knowledge, self.runs[-1]), self.ply, self.xyz, None)
        is_new = (self.work.coverage.codes == Sight.SEEN) & (self.first_seen < 0)
        self.first_seen[is_new] = len(self.runs) - 1
        if not measured.is_whole:
            raise KeyboardInterrupt
        return Returned(measured.T_WS, measured.profiles, measured.points_W)


def scan_adaptively(
    scan: Scan,
    options: ScanOptions,
    adapt: AdaptOptions,
    out: Path,
    progress: ProgressOf,
    say: Callable[[int, str], None] = lambda _number, _state: None,
    known: Scan | None = None,
) -> AdaptiveScanned:
    """Scan the predefined path if there is one, then strips until the wanted share is seen, and write the cloud.

    Whatever interrupts it, what was scanned until then is written.

    Args:
        scan: The cell, the path and what truly stands on the table.
        options: How it is scanned.
        adapt: What is wanted.
        out: Where the cloud is written.
        progress: Gives the progress of a kind of work.
        say: Called with the number of strips scanned and how far that is, after each.
        known: The same with the mesh that the strips are chosen by, where it is another one.

    Raises:
        PlannerError: It cannot be carried out, or nothing was scanned.
        TableError: The table does not answer.
        OSError: The folder cannot be written.
    """
    known = known or scan
    probe = probe_of(scan, options)
    knowledge = Knowledge.of(scan, probe, options.exact_calibration, options.seed)
    policy, surveyed = _policy(known, probe, options, adapt, progress)
    if surveyed is not None:
        path = _survey_path(surveyed, options, progress)
    else:
        path = planned_scan(scan, options.configuration, options.angle_count, progress) if scan.has_path else None
    if path is not None:
        check_motion(path, options)
    else:
        policy.next_strips()  # a part of which nothing can be reached is refused before the port is opened
    out.mkdir(parents=True, exist_ok=True)
    work = Measuring(scan.mesh, probe, options.seed, options.thinned_mm)
    with table_at_port(options) as table, cloud_files(out, scan, options) as (ply, xyz):
        cloud = _Cloud(scan, knowledge, work, ply, xyz)
        carrier = TableCarrier(Surroundings.of(known), table, options, cloud.take)
        session = run_session(
            policy, carrier, adapt.most_strips, say,
            None if path is None else lambda: carrier.scan_path(path, progress("motion")),
        )  # fmt: skip
        session, draws_back = _drawn_back(session, carrier, policy)
    if not cloud.runs:
        (out / CLOUD_FILE).unlink()
        (out / XYZ_FILE).unlink(missing_ok=True)
        raise ScanError(f"{scan.name}: nothing was scanned: {session.failure or 'no strip could be carried out'}")
    is_whole = session.failure is None
    scanned = finished(
        scan, options, probe, path or carrier.scanned[0].plan.planned, knowledge, joined(cloud.runs), work,
        ply.count, _worst(cloud.dead_lines), is_whole, out,
    )  # fmt: skip
    found = _visible(policy, session, scan, probe, options, adapt, progress)
    visible = np.ones(len(work.coverage.codes), dtype=np.bool_)
    if found is not None:
        visible = at_nearest(found.visible, Places.of(found.coverage), Places.of(work.coverage)) | (
            work.coverage.codes == Sight.SEEN
        )
    regions = unseen_regions(work.coverage, visible, float(scan.mesh.area))
    return AdaptiveScanned(
        scanned, session, tuple(carrier.scanned), path, draws_back, adapt, visible, found is not None,
        cloud.first_seen, regions,
    )  # fmt: skip


def _drawn_back(session: Session, carrier: TableCarrier, policy: Policy) -> tuple[Session, Transfer | None]:
    """Return the session, which Ctrl-C can end here too, and the way to a clear posture."""
    if session.contradicts:
        return session, None  # what the policy takes for free may not be
    try:
        return session, carrier.draw_back(policy.solid())
    except KeyboardInterrupt:
        return session._replace(failure=session.failure or "interrupted"), None


def _policy(
    known: Scan, probe: LaserProbe, options: ScanOptions, adapt: AdaptOptions, progress: ProgressOf
) -> tuple[Policy, Scan | None]:
    """Return the policy and, where it has no mesh, the scan of the bounding cylinder that comes first."""
    if adapt.bounds is None:
        return _known_part(known, probe, options, adapt, progress), None
    speed_mm_s = _DENSITY * COVERED_MM * options.triggers.rate_hz
    surveyed = survey(known, adapt.bounds, speed_mm_s)  # first: it refuses a cylinder that the table does not hold
    return UnknownPart(Surroundings.of(known), probe, adapt.bounds, speed_mm_s), surveyed


def _survey_path(surveyed: Scan, options: ScanOptions, progress: ProgressOf) -> RunInput | None:
    """Return the motion of the survey; None where the arm cannot make it, as beside a flat part: then strips begin."""
    try:
        return planned_scan(surveyed, options.configuration, options.angle_count, progress)
    except ScanError:
        return None


def _visible(
    policy: Policy,
    session: Session,
    scan: Scan,
    probe: LaserProbe,
    options: ScanOptions,
    adapt: AdaptOptions,
    progress: ProgressOf,
) -> KnownPart | None:
    """Return the policy that computed what can be seen; None where that was not computed when the session ended.

    After a session without the mesh, only the report asks for it: then the true part answers.
    """
    if isinstance(policy, KnownPart):
        return policy if policy.has_looked else None
    if session.failure is not None:
        return None
    try:
        judge = _known_part(scan, probe, options, adapt._replace(share=1.0), progress)
        with suppress(PolicyError):
            judge.next_strips()
    except KeyboardInterrupt:
        return None
    return judge


def _known_part(
    known: Scan, probe: LaserProbe, options: ScanOptions, adapt: AdaptOptions, progress: ProgressOf
) -> KnownPart:
    solid = workpiece_obstacle(known, progress("distance field"))
    speed_mm_s = _DENSITY * COVERED_MM * options.triggers.rate_hz
    return KnownPart(
        Surroundings.of(known), known.mesh, solid, probe, adapt.share, adapt.most_strips, speed_mm_s,
        progress("candidates"),
    )  # fmt: skip


def _worst(dead_lines: list[DeadLine]) -> DeadLine:
    """Return the consequences if the line had failed in any of several motions."""
    crossing = [each for each in dead_lines if each.first_s is not None]
    return DeadLine(
        max(each.longest_deg for each in dead_lines),
        sum(each.moments for each in dead_lines),
        sum(each.forbidden_moments for each in dead_lines),
        crossing[0].first_s if crossing else None,
        crossing[0].first_location if crossing else None,
    )
