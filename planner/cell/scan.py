"""A scan problem: cell, workpiece, path, limits and weights, read from one TOML file.

Keys include their units. Placements are x y z in mm and yaw pitch roll in degrees. File names in a scan file are
relative to its folder.
"""

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, fields, replace
from pathlib import Path

import numpy as np
import trimesh

from planner.arrays import FloatArray
from planner.cell.beam_check import beam_warning
from planner.cell.bodies import Bodies, load_bodies, shipped_bodies
from planner.cell.cell import Cell, Probe, Table, placement
from planner.cell.mesh_path import CLASS_OF_PATTERN, class_of, measured, mesh_waypoints
from planner.cell.patterns import PATTERNS, StripLayout
from planner.cell.scan_path import ScanPath, at_scan_speed, load_scan_path
from planner.cell.workpiece import CLASSES, Workpiece
from planner.defaults import MILLIMETERS, SCANS, shipped_scans
from planner.errors import PlannerError, ScanFileError, WorkpieceError
from planner.geometry.mesh import load_mesh, radius_about_axis_mm, size_fault
from planner.kinematics.arm import Arm, shipped_arms
from planner.kinematics.value import ValueFunction
from planner.table.cost import Weights, costs_overflow, default_weights
from planner.table.motion import Limits
from protocol.files.data_file import did_you_mean
from protocol.files.toml_table import TomlTable
from protocol.program.progress import Progress

DEFAULT_ARM = "viper_s650"
ADAPTIVE = "adaptive"
"""The pattern of a scan without a predefined path: all of its strips are chosen by what was not seen yet."""
# A workpiece may touch the table, and the base of a mesh need not be exactly flat.
_BASE_TOLERANCE_MM = 0.5
# Of any path, those of adaptive scanning included.
_FEWEST_LOCATIONS = 2


@dataclass(frozen=True, eq=False)
class Scan:
    """Everything that a configuration map and a plan need.

    Attributes:
        name: name of the scan file without its suffix.
        cell: arm, table and probe.
        bodies: bodies that move with the arm and must not collide.
        workpiece: class and dimensions of the workpiece; None for a mesh without a class.
        mesh: closed surface of the workpiece in frame W, in mm.
        mesh_file: file of that surface; None if it follows from the dimensions.
        predefined_path: the required poses of the probe; None where `path.pattern` is adaptive.
        value: the value function for poses.
        limits: limits of the table.
        weights: weights for the motion of the table.
    """

    name: str
    cell: Cell
    bodies: Bodies = field(repr=False)
    workpiece: Workpiece | None
    mesh: trimesh.Trimesh = field(repr=False)
    mesh_file: Path | None
    predefined_path: ScanPath | None = field(repr=False)
    value: ValueFunction
    limits: Limits
    weights: Weights

    @property
    def has_path(self) -> bool:
        """Whether there is a predefined path."""
        return self.predefined_path is not None

    @property
    def path(self) -> ScanPath:
        """The predefined path.

        Raises:
            ScanFileError: There is none.
        """
        if self.predefined_path is None:
            raise ScanFileError(
                f"{self.name}: path.pattern is {ADAPTIVE}: there is no predefined path to map or to plan;"
                " scan it with python -m planner scan, or choose another pattern"
            )
        return self.predefined_path


def load_scan(scan: str | Path, say: Callable[[str], None] | None = None, progress: Progress | None = None) -> Scan:
    """Return the scan from a TOML file, or a shipped one by its name.

    Args:
        scan: the file, or the name.
        say: called with one line for each harmless flaw of the mesh that was repaired. It is also called with the
            locations at which the beam does not meet the workpiece.
        progress: see `load_mesh`.

    Raises:
        PlannerError: a file cannot be read, or contains a key, value or shape that is not allowed. The message names
            it.
    """
    shipped = SCANS / f"{scan}.toml"
    file = shipped if shipped.is_file() else Path(scan)
    if not file.is_file():
        raise ScanFileError(f"{scan} is neither a scan file nor one of the shipped scans {', '.join(shipped_scans())}")
    top = TomlTable.load(file, ScanFileError)
    top.only("cell", "workpiece", "path", "value", "limits", "weights")
    with _named(file):
        cell, bodies = _read_cell(top.table("cell"), file.parent)
        workpiece, mesh, mesh_file = _read_workpiece(top.table("workpiece"), file.parent, cell, say, progress)
        check_it_fits_the_table(mesh, cell)
        path = _read_path(top.table("path"), file.parent, cell, workpiece, mesh if mesh_file else None)
        value = ValueFunction.read(top.table("value"))
        limits = _read_limits(top.table("limits"))
        weights = _read_weights(top.table("weights"), limits)
        if costs_overflow(weights, limits, _FEWEST_LOCATIONS if path is None else len(path.T_WS)):
            raise ScanFileError(f"{file}: weights: k_a or k_w is so large that the cost of a path overflows; reduce it")
    # A pattern on a shape of given dimensions always meets it.
    if say is not None and path is not None and (mesh_file is not None or "file" in top.table("path")):
        warning = beam_warning(path.T_WS, mesh, cell.probe)
        if warning is not None:
            say(f"{file}: path: {warning}")
    return Scan(file.stem, cell, bodies, workpiece, mesh, mesh_file, path, value, limits, weights)


def with_mesh(
    scan: Scan,
    file: Path,
    unit: str | None = None,
    say: Callable[[str], None] | None = None,
    progress: Progress | None = None,
) -> Scan:
    """Return the scan with the workpiece replaced by that of another file; see `load_mesh`.

    Raises:
        WorkpieceError: the mesh cannot be a workpiece, or does not fit the table.
    """
    mesh = load_mesh(file, unit, say, progress)
    with _named(file):
        check_it_fits_the_table(mesh, scan.cell)
    return replace(scan, workpiece=None, mesh=mesh, mesh_file=file)


@contextmanager
def _named(file: Path) -> Iterator[None]:
    """Add the file's name to messages without it."""
    try:
        yield
    except ScanFileError:
        raise
    except PlannerError as error:
        raise type(error)(f"{file}: {error}") from error


def _read_cell(section: TomlTable, folder: Path) -> tuple[Cell, Bodies]:
    arm_file = _beside(section, folder, "arm", shipped_arms())
    arm = Arm.load(arm_file)
    bodies_file = _bodies_file(section, folder, arm_file)
    placed = {
        name: _placement(section, key)
        for name, key in (("T_BT", "table_in_base"), ("T_TW", "workpiece_on_table"), ("T_FS", "probe_on_flange"))
        if key in section
    }
    table, probe = _read_table(section.table("table")), _read_probe(section.table("probe"))
    section.finish()
    cell = Cell(arm=arm, table=table, probe=probe, **placed)
    return cell, load_bodies(probe, cell.T_FS, bodies_file)


def _bodies_file(section: TomlTable, folder: Path, arm_file: Path | str) -> Path | str:
    """Return the file of the arm's bodies. A shipped arm has such a file; for other arms there is none."""
    if "bodies" in section:
        return _beside(section, folder, "bodies", shipped_bodies())
    if arm_file in shipped_bodies():
        return arm_file
    raise section.refuse(
        "bodies",
        f"the file of the collision bodies of {arm_file}, because those of another arm would be wrong: copy one of"
        f" {', '.join(shipped_bodies())} from planner/bodies/, and fit its capsules to the arm",
    )


def _beside(section: TomlTable, folder: Path, key: str, shipped: Sequence[str]) -> Path | str:
    """Return the file that a key names in the scan file's folder, else the name if it is a shipped one."""
    name = section.text(key, DEFAULT_ARM)
    if (folder / name).is_file():
        return folder / name
    if name not in shipped:
        raise section.refuse(
            key, f"a file beside the scan, or one of {', '.join(shipped)}{did_you_mean(name, shipped)}"
        )
    return name


def _placement(section: TomlTable, key: str) -> FloatArray:
    return placement(*section.numbers(key, 6))


def _read_table(section: TomlTable) -> Table:
    table = Table(
        **{item.name: section.number(item.name, getattr(Table, item.name), above=0.0) for item in fields(Table)}
    )
    section.finish()
    return table


def _read_probe(section: TomlTable) -> Probe:
    nearest = section.number("nearest_mm", Probe.nearest_mm, above=0.0)
    farthest = section.number("farthest_mm", Probe.farthest_mm, above=nearest)
    x, y, z = section.numbers("body_mm", 3, Probe.body_mm)
    if min(x, y, z) <= 0.0:
        raise section.refuse("body_mm", "three numbers above 0")
    probe = Probe(
        stand_off_mm=section.number("stand_off_mm", Probe.stand_off_mm, at_least=nearest, at_most=farthest),
        nearest_mm=nearest,
        farthest_mm=farthest,
        line_width_mm=section.number("line_width_mm", Probe.line_width_mm, above=0.0),
        body_mm=(x, y, z),
    )
    section.finish()
    return probe


def _read_workpiece(
    section: TomlTable, folder: Path, cell: Cell, say: Callable[[str], None] | None, progress: Progress | None
) -> tuple[Workpiece | None, trimesh.Trimesh, Path | None]:
    if "mesh" in section:
        mesh_file = folder / section.text("mesh")
        kind = section.choice("class", (*CLASSES, "other"), "other")
        unit = section.choice("unit", tuple(MILLIMETERS)) if "unit" in section else None
        section.finish()
        mesh = load_mesh(mesh_file, unit, say, progress)
        return (measured(mesh, kind, cell.T_TW)[0] if kind != "other" else None), mesh, mesh_file
    shape = CLASSES[section.choice("class", tuple(CLASSES))]
    names = [item.name for item in fields(shape) if item.name != "middle_mm"]
    workpiece = shape(middle_mm=(0.0, 0.0, 0.0), **{name: section.number(name, above=0.0) for name in names})
    section.finish()
    mesh = workpiece.mesh()
    fault = size_fault(np.asarray(mesh.extents))
    if fault is not None:
        raise WorkpieceError(fault)
    return workpiece, mesh, None


def check_it_fits_the_table(mesh: trimesh.Trimesh, cell: Cell) -> None:
    """Refuse a workpiece that extends beyond the table's edge or below its top.

    Raises:
        WorkpieceError: the workpiece does not fit.
    """
    reach_mm = radius_about_axis_mm(mesh, cell.T_TW)
    if reach_mm > cell.table.radius_mm:
        raise WorkpieceError(
            f"the workpiece extends {reach_mm:.1f} mm from the table's axis;"
            f" it must stay within the table's radius of {cell.table.radius_mm:g} mm"
        )
    lowest_mm = float((np.asarray(mesh.vertices) @ cell.T_TW[2, :3]).min() + cell.T_TW[2, 3])
    if lowest_mm < -_BASE_TOLERANCE_MM:
        raise WorkpieceError(f"the workpiece extends {-lowest_mm:.1f} mm below the table's top; it must stand on it")


def _read_path(
    section: TomlTable, folder: Path, cell: Cell, workpiece: Workpiece | None, mesh: trimesh.Trimesh | None
) -> ScanPath | None:
    """Return the path, None for an adaptive scan; `mesh` is None for a workpiece of given dimensions."""
    kind = "other" if workpiece is None else type(workpiece).__name__.lower()
    # A pattern of another class can be laid on a mesh as well.
    patterns = [ADAPTIVE, *sorted(PATTERNS[kind] if mesh is None else CLASS_OF_PATTERN)]
    if "pattern" in section and section.choice("pattern", patterns) == ADAPTIVE:
        section.finish()
        return None
    step_s = section.number("time_step_s", above=0.0)
    if "file" in section:
        file = folder / section.text("file")
        section.only("time_step_s", "file")
        return load_scan_path(file, step_s)
    if workpiece is None and "pattern" not in section:
        raise section.refuse("file", f"a path file, unless path.pattern is one of {', '.join(patterns)}")
    pattern = section.choice("pattern", patterns)
    speed_mm_s = section.number("scan_speed_mm_s", above=0.0)
    layout = _read_layout(section)
    section.finish()
    if mesh is None:
        waypoints = PATTERNS[kind][pattern](workpiece, cell.probe, layout)
    else:
        waypoints = mesh_waypoints(mesh, class_of(kind, pattern), pattern, cell.T_TW, cell.probe, layout)
    return at_scan_speed(waypoints, speed_mm_s, step_s, cell.probe.stand_off_mm, cell.probe.line_width_mm)


def _read_layout(section: TomlTable) -> StripLayout:
    top_polar_deg = section.number("top_polar_deg", StripLayout.top_polar_deg, at_least=0.0, at_most=170.0)
    return StripLayout(
        overlap=section.number("overlap", StripLayout.overlap, at_least=0.0, at_most=0.9),
        top_polar_deg=top_polar_deg,
        lowest_polar_deg=section.number(
            "lowest_polar_deg", StripLayout.lowest_polar_deg, above=top_polar_deg, at_most=180.0
        ),
        bottom_margin_mm=section.number("bottom_margin_mm", StripLayout.bottom_margin_mm, at_least=0.0),
        wall_margin_mm=section.number("wall_margin_mm", StripLayout.wall_margin_mm, at_least=0.0),
        tilt_deg=section.number("tilt_deg", StripLayout.tilt_deg, at_least=0.0, at_most=60.0),
    )


def _read_limits(section: TomlTable) -> Limits:
    default = Limits()
    limits = Limits(
        speed_deg_s=section.number("table_speed_deg_s", default.speed_deg_s, above=0.0),
        acceleration_deg_s2=section.number("table_acceleration_deg_s2", default.acceleration_deg_s2, above=0.0),
    )
    section.finish()
    return limits


def _read_weights(section: TomlTable, limits: Limits) -> Weights:
    default = default_weights(limits)
    weights = Weights(
        acceleration=section.number("k_a", default.acceleration, at_least=0.0),
        speed=section.number("k_w", default.speed, at_least=0.0),
    )
    section.finish()
    return weights
