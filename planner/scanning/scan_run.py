"""A complete scan: plan, move and latch, measure, align, write, error budget.

The workpiece is measured at its true position, at the true angle of the table, and aligned with the latched values. The
difference is the error that the error budget divides among its sources.
"""

from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple, Self

import numpy as np

from planner.cell.cell import placement
from planner.cell.scan import Scan
from planner.defaults import DEFAULT_PLANNER, RUN_ON_DEG
from planner.errors import PlannerError
from planner.execution.clear_path import check_ends
from planner.execution.dead_line import DeadLine, judge_dead_line
from planner.execution.execute import Settings
from planner.execution.run_input import RunInput
from planner.execution.stream import check_it_fits, stream
from planner.execution.table_port import CONTROL_TIMEOUT_S, open_port
from planner.geometry.point_normals import point_normals
from planner.geometry.thinned_cloud import ThinnedCloud
from planner.planning.planners import PLANNERS
from planner.planning.scan_planning import plan_scan
from planner.plans.arm_check import PlannedArm, arm_fault
from planner.scanning.alignment import Calibration
from planner.scanning.calibration import AxisCalibration, PartSize
from planner.scanning.coverage import Coverage
from planner.scanning.error_budget import Chain, ErrorBudget, error_budget_of
from planner.scanning.latched_run import LatchedRun, TriggerConditions, run_latched
from planner.scanning.measuring import Measuring, known_poses
from planner.scanning.point_cloud import PlyWriter, XyzWriter, write_normals
from planner.scanning.pose_table import write_poses
from planner.scanning.probe import LaserProbe
from planner.scanning.probe_calibration import ProbeCalibration
from planner.scanning.reference_sphere import calibrate_cell
from planner.scanning.surface_mesh import save_surface, surface_mesh
from planner.scanning.trigger_line import ProbeByHand, ProbeOnPort, TriggerLine
from planner.table.wire import Wire
from protocol import Port, TableClient
from protocol.bench import bench_of
from protocol.control_channel import ControlChannel
from protocol.program.progress import Progress, ProgressOf

CLOUD_FILE, XYZ_FILE, POSES_FILE = "cloud.ply", "cloud.xyz", "poses.csv"
# Cells of the thinned cloud, and how far the neighbors are that a normal is made from.
_THINNED_MM, _NORMAL_MM = 0.5, 2.5


class ScanError(PlannerError):
    """A scan that cannot be performed."""


class ScanOptions(NamedTuple):
    """Settings of a scan; see the options of `python -m planner scan`."""

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

    @property
    def thinned_mm(self) -> float | None:
        """Cells of the thinned cloud, where one is asked for."""
        return _THINNED_MM if self.normals or self.surface is not None else None


@dataclass(frozen=True, eq=False)
class Knowledge:
    """The placements for the alignment, and the measurements that they are from."""

    calibration: Calibration
    axis: AxisCalibration | None = None
    probe: ProbeCalibration | None = None

    @classmethod
    def of(cls, scan: Scan, probe: LaserProbe, exact: bool, seed: int) -> Self:
        """Return the cell's own placements, or the calibrated ones, starting from a drawing with errors of some mm."""
        true = Calibration.of(scan.cell)
        if exact:
            return cls(true)
        off = placement(1.0, -1.5, 0.0, 0.0, 0.0, 0.0) @ placement(0.0, 0.0, 0.0, 30.0, 0.5, -30.0)
        found = calibrate_cell(true, Calibration(true.T_FS @ off, true.T_BT, true.T_TW), probe, seed, _part_size(scan))
        return cls(found.calibration, found.axis, found.probe)


def _part_size(scan: Scan) -> PartSize:
    """Return the cylinder around the table's axis that contains the workpiece."""
    on_table = np.asarray(scan.mesh.vertices) @ scan.cell.T_TW[:3, :3].T + scan.cell.T_TW[:3, 3]
    return PartSize(float(np.hypot(on_table[:, 0], on_table[:, 1]).max()), float(on_table[:, 2].max()))


@dataclass(frozen=True, eq=False)
class Scanned:
    """What a scan came to.

    Attributes:
        planned: The motion, the first one of several.
        run: What was latched, in all motions together.
        dead_line: the consequences if the line had failed.
    """

    scan: Scan
    options: ScanOptions
    probe: LaserProbe
    planned: RunInput
    knowledge: Knowledge
    run: LatchedRun
    points: int
    coverage: Coverage
    budget: ErrorBudget
    dead_line: DeadLine
    is_interrupted: bool

    @property
    def is_whole(self) -> bool:
        """Whether the motion and the measurement were completed."""
        return self.run.failure is None and not self.is_interrupted


def planned_scan(scan: Scan, configuration: str, angle_count: int, progress: ProgressOf) -> RunInput:
    """Return the best motion for a scan.

    Raises:
        ScanError: there is no motion that the arm can follow.
    """
    plans = plan_scan(scan, configuration, angle_count, PLANNERS[DEFAULT_PLANNER], progress, compiled=DEFAULT_PLANNER)
    planned = plans.best
    if planned is None:
        raise ScanError(plans.comparison.why_no_plan(scan))
    joints_deg = planned.arm.robot_deg
    fault = arm_fault(PlannedArm(scan.cell, scan.path.T_WS, joints_deg), planned.plan)
    if fault is not None:
        raise ScanError(f"{scan.name}: the arm cannot follow the plan: {fault}")
    return RunInput(scan.name, planned.plan, planned.problem, joints_deg, scan.cell.arm)


class TableAtPort(NamedTuple):
    """A table at an open port."""

    port: Port
    client: TableClient


@contextmanager
def table_at_port(options: ScanOptions) -> Iterator[TableAtPort]:
    """Open the port of a scan for as long as the block lasts.

    Raises:
        TableError: It cannot be opened.
    """
    port = open_port(options.port, options.baud, options.timeout_s, options.time_scale)
    with TableClient(port, options.timeout_s * options.time_scale, options.decimals) as client:
        yield TableAtPort(port, client)


def check_motion(planned: RunInput, options: ScanOptions) -> None:
    """Refuse a motion that must not be made, or cannot be streamed.

    Raises:
        PlannerError: The table would run up or out through a forbidden region, or the commands do not fit the line.
    """
    wire = Wire(options.decimals, options.baud)
    motion = planned.motion()
    check_ends(planned.problem.map, motion)
    check_it_fits(stream(motion, planned.problem.limits, wire, options.run_on_deg), wire)


def run_on_port(planned: RunInput, options: ScanOptions, progress: ProgressOf) -> LatchedRun:
    """Return the values latched while the table at the port executed the motion.

    Raises:
        PlannerError: The motion is refused, the port lets no trigger through, or nothing was scanned.
        TableError: The table does not answer, or did not come to the start.
    """
    check_motion(planned, options)
    with table_at_port(options) as table:
        return run_on_table(table, planned, options, progress("motion"))


def run_on_table(table: TableAtPort, planned: RunInput, options: ScanOptions, progress: Progress | None) -> LatchedRun:
    """Return what was latched while the table made a motion that was checked; see `run_on_port`."""
    return run_latched(
        table.client,
        _trigger_line(table.port, table.client, options),
        planned.plan,
        planned.joints_deg,
        planned.problem.limits,
        Wire(options.decimals, options.baud),
        options.triggers,
        Settings(lag_s=options.lag_s, run_on_deg=options.run_on_deg),
        progress,
    )


def _trigger_line(port: object, table: TableClient, options: ScanOptions) -> TriggerLine:
    simulated = bench_of(port)
    conditions = options.triggers
    if simulated is not None:
        return ProbeOnPort(simulated, conditions.rate_hz, conditions.delay_s, conditions.faults, conditions.seed)
    if options.control is None:
        raise ScanError(
            f"{options.port}: the simulated probe cannot trigger this table;"
            " use emulator://, or an emulator with its --control channel"
        )
    return ProbeByHand(ControlChannel(options.control, CONTROL_TIMEOUT_S), table.clock)


def scan_workpiece(scan: Scan, options: ScanOptions, out: Path, progress: ProgressOf) -> Scanned:
    """Perform a scan, write its cloud to `out`, and return the results.

    After an interruption, the data scanned so far are written.

    Raises:
        PlannerError: the scan cannot be performed, or nothing was scanned.
        TableError: the table does not reply.
        OSError: the folder cannot be written.
    """
    probe = probe_of(scan, options)
    knowledge = Knowledge.of(scan, probe, options.exact_calibration, options.seed)
    planned = planned_scan(scan, options.configuration, options.angle_count, progress)
    out.mkdir(parents=True, exist_ok=True)
    run = run_on_port(planned, options, progress)
    chain = chain_of(scan, knowledge, run)
    work = Measuring(scan.mesh, probe, options.seed, options.thinned_mm)
    with cloud_files(out, scan, options) as (ply, xyz):
        measured = work.take(chain, ply, xyz, progress("profiles"))
    dead_line = judge_dead_line(planned.problem.map, planned.motion(), run.record)
    return finished(scan, options, probe, planned, knowledge, run, work, ply.count, dead_line, measured.is_whole, out)


def probe_of(scan: Scan, options: ScanOptions) -> LaserProbe:
    """Return the probe of a scan.

    Raises:
        ScanError: It is not fast enough.
    """
    probe = options.probe or LaserProbe.of(scan.cell.probe)
    if options.triggers.rate_hz > probe.line_rate_hz:
        raise ScanError(
            f"a rate of {options.triggers.rate_hz:g} profiles a second is beyond the probe's {probe.line_rate_hz:g}"
        )
    return probe


def chain_of(scan: Scan, knowledge: Knowledge, run: LatchedRun) -> Chain:
    """Return a run with the true placements and those that are known."""
    arm = scan.cell.arm
    return Chain(run, Calibration.of(scan.cell), knowledge.calibration, lambda deg: arm.flange_poses(arm.joints(deg)))


@contextmanager
def cloud_files(out: Path, scan: Scan, options: ScanOptions) -> Iterator[tuple[PlyWriter, XyzWriter | None]]:
    """Open the files of a cloud in `out`; they appear when they are closed."""
    with ExitStack() as files:
        ply = files.enter_context(PlyWriter(out / CLOUD_FILE, f"seventh-axis scan {scan.name}, seed {options.seed}"))
        yield ply, files.enter_context(XyzWriter(out / XYZ_FILE)) if options.xyz else None


def finished(
    scan: Scan,
    options: ScanOptions,
    probe: LaserProbe,
    planned: RunInput,
    knowledge: Knowledge,
    run: LatchedRun,
    work: Measuring,
    points: int,
    dead_line: DeadLine,
    is_whole: bool,
    out: Path,
) -> Scanned:
    """Write what belongs to a cloud beside it, and return what the scan came to.

    Raises:
        ScanError: Nothing was scanned.
    """
    if not points:
        (out / CLOUD_FILE).unlink()
        (out / XYZ_FILE).unlink(missing_ok=True)
        raise ScanError(f"nothing was scanned: none of {len(run.numbers)} profiles meets the workpiece")
    chain = chain_of(scan, knowledge, run)
    T_BF = chain.flange_poses(run.joints_deg)
    write_poses(out / POSES_FILE, run.numbers, run.times_s, run.angles_deg, run.joints_deg, T_BF, known_poses(chain))
    if work.thinned is not None:
        write_surface(work.thinned, scan.name, options, out)
    budget = error_budget_of(chain, work.samples.all(), scan.mesh, 10.0**-options.decimals)
    return Scanned(
        scan, options, probe, planned, knowledge, run, points, work.coverage, budget, dead_line, not is_whole
    )


def write_surface(cloud: ThinnedCloud, name: str, options: ScanOptions, out: Path) -> None:
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
