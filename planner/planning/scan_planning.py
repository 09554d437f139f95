"""From a scan to the best plan: its maps, a problem for each arm configuration, and the results of the planner."""

import logging
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

from planner.cell.scan import Scan
from planner.kinematics.configuration import Configuration
from planner.map.map_builder import build_maps, is_compiled
from planner.map.map_file import MAP_FILE, save_maps
from planner.map.map_problem import map_problem
from planner.planning.best_configuration import Comparison, best_configuration
from planner.planning.compiling import compiling_beside
from planner.planning.scan_problem import scan_problem
from planner.plans.arm_motion import ArmMotion, arm_motion
from planner.plans.plan import Outcome, Plan, Planner
from planner.plans.plan_file import PLAN_FILE, plan_document, save_plan
from planner.plans.problem import Problem
from planner.plans.verification import Verification, verify
from protocol.program.progress import ProgressOf

_log = logging.getLogger(__name__)


@dataclass(frozen=True, eq=False)
class PlannedScan:
    """A scan with the plan of its best arm configuration.

    Attributes:
        scan: the scan.
        problem: map, limits and weights of that configuration.
        plan: the motion of the table.
        arm: the matching motion of the arm.
        outcomes: the result of the planner in each configuration, by name.
    """

    scan: Scan
    problem: Problem
    plan: Plan
    arm: ArmMotion
    outcomes: dict[str, Outcome]

    @property
    def verification(self) -> Verification:
        """The result of a check of the plan before its execution."""
        return verify(self.problem, self.plan)

    @property
    def is_executable(self) -> bool:
        """Whether the table can execute the plan, nothing forbidden is touched, and the arm can follow."""
        return self.verification.is_executable and self.arm.step is None

    def save(self, folder: str | Path) -> Path:
        """Write `plan.json` and `map.npz` to a folder. Return the first, which is the input of `python -m planner run`.

        Raises:
            OSError: the files cannot be written.
        """
        plan_file = Path(folder) / PLAN_FILE
        plan_file.parent.mkdir(parents=True, exist_ok=True)
        save_plan(plan_file, plan_document(self.scan, self.problem, self.plan, self.arm))
        save_maps(plan_file.with_name(MAP_FILE), {Configuration.parse(self.plan.configuration): self.problem.map})
        return plan_file


class ScanPlans(NamedTuple):
    """The planning results of a scan, by configuration."""

    scan: Scan
    problems: Mapping[str, Problem]
    comparison: Comparison

    @property
    def best(self) -> PlannedScan | None:
        """The best plan with its problem and the motion of the arm; None if there is no plan."""
        if self.comparison.best is None:
            return None
        problem, plan = self.problems[self.comparison.best], self.comparison.outcomes[self.comparison.best]
        assert isinstance(plan, Plan)
        assert problem.arm is not None
        return PlannedScan(self.scan, problem, plan, arm_motion(problem.arm, plan), dict(self.comparison.outcomes))


def plan_scan(
    scan: Scan,
    configuration: str,
    angle_count: int,
    planner: Planner,
    progress: ProgressOf,
    start_angle_deg: float | None = None,
    compiled: str = "",
) -> ScanPlans:
    """Plan a scan in one arm configuration, or in all of them.

    Args:
        scan: the scan.
        configuration: its name, or `best` to compare all.
        angle_count: table angles of a map.
        planner: the planner.
        progress: gives the progress function for a kind of work.
        start_angle_deg: the table's angle at the first location, if it is given.
        compiled: name of the planner, if its machine code may be compiled in parallel with the maps.

    Raises:
        ConfigurationNameError: the name does not exist.
    """
    asked = list(Configuration) if configuration == "best" else [Configuration.parse(configuration)]
    with compiling_beside(compiled, progress):
        problem = map_problem(scan, progress("distance field"))
        maps = build_maps(problem, asked, angle_count, progress("map" if is_compiled() else "map (compiling, once)"))
        _log.debug("%s: %d locations, %d table angles, %d map(s)", scan.name, len(problem.T_WS), angle_count, len(maps))
        problems = {each.label: scan_problem(scan, map_, start_angle_deg) for each, map_ in maps.items()}
        return ScanPlans(scan, problems, best_configuration(problems, planner, progress("plan")))
