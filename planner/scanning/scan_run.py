"""A scan from end to end: plan, move and latch, measure, align, write, account.

The workpiece is measured where it truly is, at the table's true angle, and aligned with what was latched: the
difference is the error that the account takes apart.
"""

from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple, Self

import numpy as np
import trimesh

from planner.arrays import FloatArray
from planner.cell.cell import placement
from planner.cell.scan import Scan
from planner.defaults import DEFAULT_PLANNER, RUN_ON_DEG
from planner.errors import PlannerError
from planner.execution.dead_line import DeadLine, judge_dead_line
from planner.execution.execute import Settings
from planner.execution.free_way import check_ends
from planner.execution.stream import check_it_fits, stream
from planner.execution.table_motion import TableMotion
from planner.execution.table_port import CONTROL_TIMEOUT_S, open_port
from planner.geometry.point_normals import point_normals
from planner.geometry.ray_casting import RayCaster
from planner.geometry.thinned_cloud import ThinnedCloud
from planner.map.config_map import ConfigurationMap
from planner.planning.arm_check import PlannedArm, arm_fault
from planner.planning.plan import Plan
from planner.planning.planners import PLANNERS
from planner.planning.scan_planning import plan_scan
from planner.scanning.alignment import Calibration, aligned, probe_poses
from planner.scanning.calibration import AxisCalibration, PartSize
from planner.scanning.coverage import Coverage
from planner.scanning.error_account import Account, Chain, Samples, account
from planner.scanning.latched_run import LatchedRun, TriggerConditions, run_latched
from planner.scanning.point_cloud import PlyWriter, XyzWriter, write_normals
from planner.scanning.pose_table import write_poses
from planner.scanning.probe import LaserProbe, measure
from planner.scanning.probe_calibration import ProbeCalibration
from planner.scanning.reference_sphere import calibrate_cell
from planner.scanning.surface_mesh import save_surface, surface_mesh
from planner.scanning.trigger_line import ProbeByHand, ProbeOnPort, TriggerLine
from planner.table.motion import Limits
from planner.table.wire import Wire
from protocol import TableClient
from protocol.bench import bench_of
from protocol.control_channel import ControlChannel
from protocol.progress import Progress, ProgressOf

# Profiles that are measured at once: some 40 000 points.
_BLOCK = 64
# Profiles that are nearer to one another leave no gap.
COVERED_MM = 2.0
# Cells of the thinned cloud, and how far the neighbors are that a normal is made from.
_THINNED_MM, _NORMAL_MM = 0.5, 2.5


class ScanError(PlannerError):
    """A scan that cannot be carried out."""


class ScanOptions(NamedTuple):
    """How a scan is carried out; see the options of `python -m planner scan`."""

    port: str = "emulator://"
    baud: int = 9600
    decimals: int = 1
    lag_s: float = Settings().lag_s
    timeout_s: float = 0.5
    control: Path | None = None
    time_scale: float = 1.0
    run_on_deg: float = RUN_ON_DEG
    configuration: str = "best"
    angle_count: int = 360
    exact_calibration: bool = False
    xyz: bool = False
    normals: bool = False
    surface: Path | None = None
    probe: LaserProbe | None = None
    triggers: TriggerConditions = TriggerConditions()
    seed: int = 0


@dataclass(frozen=True, eq=False)
class Planned:
    """The motion of a scan: the table's plan on its map, and the arm's joints `(n + 1, 6)` in deg along it."""

    plan: Plan
    joints_deg: FloatArray
    limits: Limits
    map: ConfigurationMap

    @property
    def motion(self) -> TableMotion:
        """What the table does."""
        return TableMotion(self.plan, self.limits)


@dataclass(frozen=True, eq=False)
class Knowledge:
    """What the alignment knows of the cell, and from which measurements."""

    calibration: Calibration
    axis: AxisCalibration | None = None
    probe: ProbeCalibration | None = None

    @classmethod
    def of(cls, scan: Scan, probe: LaserProbe, exact: bool, seed: int) -> Self:
        """Return the cell's own placements, or what the calibrations find from a drawing that is some mm off."""
        true = Calibration.of(scan.cell)
        if exact:
            return cls(true)
        off = placement(1.0, -1.5, 0.0, 0.0, 0.0, 0.0) @ placement(0.0, 0.0, 0.0, 30.0, 0.5, -30.0)
        found = calibrate_cell(true, Calibration(true.T_FS @ off, true.T_BT, true.T_TW), probe, seed, _part_size(scan))
        return cls(found.calibration, found.axis, found.probe)


def _part_size(scan: Scan) -> PartSize:
    """Return the cylinder about the table's axis that holds the workpiece."""
    on_table = np.asarray(scan.mesh.vertices) @ scan.cell.T_TW[:3, :3].T + scan.cell.T_TW[:3, 3]
    return PartSize(float(np.hypot(on_table[:, 0], on_table[:, 1]).max()), float(on_table[:, 2].max()))


@dataclass(frozen=True, eq=False)
class Scanned:
    """What a scan came to."""

    scan: Scan
    options: ScanOptions
    probe: LaserProbe
    planned: Planned
    knowledge: Knowledge
    run: LatchedRun
    points: int
    coverage: Coverage
    account: Account
    is_interrupted: bool

    @property
    def dead_line(self) -> DeadLine:
        """How far the table would have run on if the line had died, and into what."""
        return judge_dead_line(self.planned.map, self.planned.motion, self.run.record)

    @property
    def is_whole(self) -> bool:
        """Whether the motion and the measuring came to their ends."""
        return self.run.failure is None and not self.is_interrupted


def planned_scan(scan: Scan, configuration: str, angle_count: int, progress: ProgressOf) -> Planned:
    """Return the best motion for a scan.

    Raises:
        ScanError: There is none that the arm can follow.
    """
    plans = plan_scan(scan, configuration, angle_count, PLANNERS[DEFAULT_PLANNER], progress, compiled=DEFAULT_PLANNER)
    if plans.best is None:
        raise ScanError(plans.comparison.why_no_plan(scan))
    problem, plan, motion = plans.best
    fault = arm_fault(PlannedArm(scan.cell, scan.path.T_WS, motion.robot_deg), plan)
    if fault is not None:
        raise ScanError(f"{scan.name}: the arm cannot follow the plan: {fault}")
    return Planned(plan, motion.robot_deg, scan.limits, problem.map)


def run_on_port(planned: Planned, options: ScanOptions, progress: ProgressOf) -> LatchedRun:
    """Return what was latched while the table at the port made the motion.

    Raises:
        PlannerError: The port lets no trigger through, the commands do not fit it, the table would run up or out
            through a forbidden region, or nothing was scanned.
        TableError: The table does not answer, or did not come to the start.
    """
    wire = Wire(options.decimals, options.baud)
    check_ends(planned.map, planned.motion)
    check_it_fits(stream(planned.motion, planned.limits, wire, options.run_on_deg), wire)
    port = open_port(options.port, options.baud, options.timeout_s, options.time_scale)
    with TableClient(port, options.timeout_s * options.time_scale, options.decimals) as table:
        line = _trigger_line(port, table, options)
        settings = Settings(lag_s=options.lag_s, run_on_deg=options.run_on_deg)
        return run_latched(
            table,
            line,
            planned.plan,
            planned.joints_deg,
            planned.limits,
            wire,
            options.triggers,
            settings,
            progress("motion"),
        )


def _trigger_line(port: object, table: TableClient, options: ScanOptions) -> TriggerLine:
    simulated = bench_of(port)
    conditions = options.triggers
    if simulated is not None:
        return ProbeOnPort(simulated, conditions.rate_hz, conditions.delay_s, conditions.faults, conditions.seed)
    if options.control is None:
        raise ScanError(
            f"{options.port}: the simulated probe has no line to trigger this table;"
            " use emulator://, or an emulator with its --control channel"
        )
    return ProbeByHand(ControlChannel(options.control, CONTROL_TIMEOUT_S), table.clock)


def scan_workpiece(scan: Scan, options: ScanOptions, out: Path, progress: ProgressOf) -> Scanned:
    """Carry a scan out, write its cloud to `out`, and return what it came to.

    Whatever interrupts it, what was scanned until then is written.

    Raises:
        PlannerError: It cannot be carried out, or nothing was scanned.
        TableError: The table does not answer.
        OSError: The folder cannot be written.
    """
    probe = options.probe or LaserProbe.of(scan.cell.probe)
    if options.triggers.rate_hz > probe.line_rate_hz:
        raise ScanError(
            f"a rate of {options.triggers.rate_hz:g} profiles a second is beyond the probe's {probe.line_rate_hz:g}"
        )
    knowledge = Knowledge.of(scan, probe, options.exact_calibration, options.seed)
    planned = planned_scan(scan, options.configuration, options.angle_count, progress)
    out.mkdir(parents=True, exist_ok=True)
    run = run_on_port(planned, options, progress)
    arm = scan.cell.arm
    chain = Chain(run, Calibration.of(scan.cell), knowledge.calibration, lambda deg: arm.flange_poses(arm.joints(deg)))
    work = _Measuring(scan.mesh, probe, chain, options)
    with ExitStack() as files:
        ply = files.enter_context(PlyWriter(out / "cloud.ply", f"seventh-axis scan {scan.name}, seed {options.seed}"))
        xyz = files.enter_context(XyzWriter(out / "cloud.xyz")) if options.xyz else None
        came_to_its_end = work.go(ply, xyz, progress("profiles"))
    if not ply.count:
        (out / "cloud.ply").unlink()
        (out / "cloud.xyz").unlink(missing_ok=True)
        raise ScanError(f"nothing was scanned: none of {len(run.numbers)} profiles meets the workpiece")
    work.write_poses(out / "poses.csv")
    if work.thinned is not None:
        _write_surface(work.thinned, scan.name, options, out)
    accounted = account(chain, work.samples.all(), scan.mesh, 10.0**-options.decimals)
    return Scanned(
        scan, options, probe, planned, knowledge, run, ply.count, work.coverage, accounted, not came_to_its_end
    )


def _write_surface(cloud: ThinnedCloud, name: str, options: ScanOptions, out: Path) -> None:
    """Write the thinned cloud with its normals, and the surface through it, as far as they were asked for."""
    points = cloud.points
    found = point_normals(points, cloud.beams, _NORMAL_MM)
    if options.normals:
        comment = f"seventh-axis scan {name}, seed {options.seed}, mean points of cells of {cloud.cell_mm:g} mm"
        write_normals(out / "normals.ply", points[found.is_known], found.normals[found.is_known], comment)
    if options.surface is not None:
        save_surface(
            options.surface, surface_mesh(points[found.is_known], found.normals[found.is_known], cloud.cell_mm)
        )


class _Measuring:
    """The profiles of a run, block by block, from the probe to the cloud."""

    def __init__(self, mesh: trimesh.Trimesh, probe: LaserProbe, chain: Chain, options: ScanOptions) -> None:
        self.samples = Samples()
        asked = options.normals or options.surface is not None
        self.thinned = ThinnedCloud(_THINNED_MM) if asked else None
        caster = RayCaster(mesh)
        self.coverage = Coverage(mesh, caster, probe, COVERED_MM)
        self._caster, self._probe, self._chain, self._seed = caster, probe, chain, options.seed

    def go(self, ply: PlyWriter, xyz: XyzWriter | None, progress: Progress | None) -> bool:
        """Measure, align and write all profiles; return False when Ctrl-C came before the last."""
        total = len(self._chain.run.numbers)
        true_T_WS, known_T_WS = self._chain.poses(()), self._known_poses()
        try:
            for first in range(0, total, _BLOCK):
                block = slice(first, first + _BLOCK)
                self._measure(first, true_T_WS[block], known_T_WS[block], ply, xyz)
                if progress is not None:
                    progress(min(first + _BLOCK, total), total)
        except KeyboardInterrupt:
            return False
        return True

    def write_poses(self, file: Path) -> None:
        """Write the latched pose of every profile."""
        run, chain = self._chain.run, self._chain
        T_BF = chain.flange_poses(run.joints_deg)
        write_poses(file, run.numbers, run.times_s, run.angles_deg, run.joints_deg, T_BF, self._known_poses())

    def _known_poses(self) -> FloatArray:
        """Return T_WS `(n, 4, 4)` from what was latched and calibrated alone."""
        run, chain = self._chain.run, self._chain
        return probe_poses(chain.known, chain.flange_poses(run.joints_deg), run.angles_deg)

    def _measure(
        self, first: int, true_T_WS: FloatArray, known_T_WS: FloatArray, ply: PlyWriter, xyz: XyzWriter | None
    ) -> None:
        numbers = self._chain.run.numbers[first : first + len(true_T_WS)]
        seen = measure(self._caster, self._probe, true_T_WS, numbers, self._seed)
        points = aligned(known_T_WS, seen.profiles, seen.points_S)
        beams = np.einsum("ijk,ik->ij", known_T_WS[seen.profiles, :3, :3], seen.rays_S)
        ply.write(points, beams, numbers[seen.profiles])
        if xyz is not None:
            xyz.write(points)
        if self.thinned is not None:
            self.thinned.take(points, beams)
        self.samples.take(first, seen)
        self.coverage.take(true_T_WS)
