"""The Python interface of the planner, from a scan to maps, a plan and a verified run; see `import planner`."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory

from planner.cell.scan import Scan
from planner.defaults import DEFAULT_PLANNER, RECEDING
from planner.execution.run import Finished, RunOptions, run_plan
from planner.kinematics.configuration import Configuration
from planner.kinematics.value import UserFactor
from planner.map.config_map import ConfigurationMap
from planner.map.map_builder import build_maps as maps_of
from planner.map.map_problem import map_problem
from planner.planning.own_planners import checked, planner_named
from planner.planning.scan_planning import PlannedScan, plan_scan
from planner.plans.plan import NoPlan, Outcome, Planner
from planner.plans.problem import Problem
from planner.table.wire import Wire
from planner.tracking.tracker import Tracker, TrackSettings


def with_factors(scan: Scan, *factors: UserFactor) -> Scan:
    """Return the scan with additional factors of the value function."""
    return replace(scan, value=replace(scan.value, user_factors=(*scan.value.user_factors, *factors)))


def build_maps(
    scan: Scan, configurations: Sequence[Configuration] = tuple(Configuration), angle_count: int = 360
) -> dict[Configuration, ConfigurationMap]:
    """Return the maps `(locations, angle_count)` of a scan, by arm configuration.

    Raises:
        PlannerError: the maps would have too many cells, or an installed factor failed.
        ValueError: a factor of `with_factors` returned a wrong shape or a value outside of 0 to 1.
    """
    return maps_of(map_problem(scan), configurations, angle_count)


def plan(
    scan: Scan,
    planner: str | Callable[[Problem], Outcome] = DEFAULT_PLANNER,
    configuration: str = "best",
    angle_count: int = 360,
    start_angle_deg: float | None = None,
) -> PlannedScan | NoPlan:
    """Plan the table's motion along a scan.

    Args:
        scan: the scan.
        planner: the name of a shipped planner or an installed plug-in, or a function.
        configuration: an arm configuration such as `LEFTY-ABOVE-NOFLIP`, or `best`.
        angle_count: number of table angles over one turn.
        start_angle_deg: table angle at the first location; None: any angle.

    Returns:
        The plan with minimum cost that the arm can follow, or the reason why there is none.

    Raises:
        PlannerError: a name is unknown, or the planner returned an invalid result.
    """
    chosen: Planner = planner_named(planner) if isinstance(planner, str) else checked(_name(planner), planner)
    shipped = planner if isinstance(planner, str) else ""
    plans = plan_scan(scan, configuration, angle_count, chosen, lambda _label: None, start_angle_deg, shipped)
    return plans.best or plans.comparison.farthest[1]


def _name(planner: Callable[[Problem], Outcome]) -> str:
    return str(getattr(planner, "__name__", type(planner).__name__))


def run(
    planned: PlannedScan | str | Path,
    port: str,
    out: str | Path,
    options: RunOptions | None = None,
) -> Finished:
    """Execute a plan on the table at a port, verify the motion, and write the results to a folder.

    Args:
        planned: a plan, or the name of a `plan.json`.
        port: a device, `socket://HOST:PORT`, or `emulator://` for a simulated table.
        out: the folder.
        options: all other settings; its `port` is ignored.

    Raises:
        PlannerError: the plan must not or cannot be executed; the table has not moved.
        TableError: the table did not reply, or did not reach the start.
        OSError: the folder cannot be written.
    """
    chosen = RunOptions(port) if options is None else options._replace(port=port)
    if not isinstance(planned, PlannedScan):
        return run_plan(Path(planned), Path(out), chosen)
    with TemporaryDirectory() as folder:
        return run_plan(planned.save(folder), Path(out), chosen)


def tracker(
    scan: Scan,
    planner: str = RECEDING,
    configuration: str = "best",
    angle_count: int = 360,
    view: int = 50,
    wire: Wire | None = None,
) -> Tracker:
    """Return a tracker of a scan whose locations become known while the table moves; none is known yet.

    Args:
        scan: the cell, the limits, the weights and the time step; its path is not used.
        planner: `receding` or `ray_shooting`.
        configuration: an arm configuration such as `LEFTY-ABOVE-NOFLIP`, or `best`.
        angle_count: number of table angles over one turn.
        view: maximum number of locations that are known ahead of the table.
        wire: baud rate and decimal places; None: 9600 baud, one decimal place.

    Raises:
        PlannerError: the planner is not one of these, or the time step is too short for the wire.
    """
    names = list(Configuration) if configuration == "best" else [Configuration.parse(configuration)]
    settings = TrackSettings(planner, view)
    return Tracker(map_problem(scan), scan.path.step_s, scan.limits, scan.weights, wire, settings, names, angle_count)
