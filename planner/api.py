"""What programs use of the planner, from a scan to maps, to a plan, to a verified run; see `import planner`."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory

from planner.cell.scan import Scan
from planner.defaults import DEFAULT_PLANNER
from planner.execution.run import Finished, RunOptions, run_plan
from planner.kinematics.configuration import Configuration
from planner.kinematics.value import UserFactor
from planner.map.config_map import ConfigurationMap
from planner.map.map_builder import build_maps as maps_of
from planner.map.map_problem import map_problem
from planner.planning.own_planners import checked, planner_named
from planner.planning.plan import NoPlan, Outcome, Planner
from planner.planning.problem import Problem
from planner.planning.scan_planning import PlannedScan, plan_scan


def with_factors(scan: Scan, *factors: UserFactor) -> Scan:
    """Return the scan with further factors of the value function."""
    return replace(scan, value=replace(scan.value, user_factors=(*scan.value.user_factors, *factors)))


def build_maps(
    scan: Scan, configurations: Sequence[Configuration] = tuple(Configuration), angle_count: int = 360
) -> dict[Configuration, ConfigurationMap]:
    """Return the maps `(locations, angle_count)` of a scan, by arm configuration.

    Raises:
        PlannerError: The maps would have too many cells, or an installed factor failed.
        ValueError: A factor of `with_factors` returned a wrong shape or a value outside 0 to 1.
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
        scan: What is scanned.
        planner: A shipped planner or an installed plug-in by its name, or a function.
        configuration: An arm configuration such as `LEFTY-ABOVE-NOFLIP`, or `best`.
        angle_count: Table angles over one turn.
        start_angle_deg: The table's angle at the first location; None leaves it free.

    Returns:
        The plan that the arm can follow at the least cost, or, where there is none, why.

    Raises:
        PlannerError: A name is not known, or the planner returned something that is not an answer.
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
    """Carry a plan out on the table at a port, verify the motion, and write what happened into a folder.

    Args:
        planned: A plan, or the name of a `plan.json`.
        port: A device, `socket://HOST:PORT`, or `emulator://` for a simulated table.
        out: The folder.
        options: All other settings; `port` in it does not count.

    Raises:
        PlannerError: The plan must not, or cannot, be run; nothing has moved.
        TableError: The table could not be reached, or not be brought to the start.
        OSError: The folder cannot be written.
    """
    chosen = RunOptions(port) if options is None else options._replace(port=port)
    if not isinstance(planned, PlannedScan):
        return run_plan(Path(planned), Path(out), chosen)
    with TemporaryDirectory() as folder:
        return run_plan(planned.save(folder), Path(out), chosen)
