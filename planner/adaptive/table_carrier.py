"""Carries strips out: plans each, finds the way to it, makes its motion on a table, and verifies it as any scan's."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from planner.adaptive.continuous_check import ContinuousCheck
from planner.adaptive.order import best_tour, travel_times
from planner.adaptive.policy import Returned
from planner.adaptive.session import CarrierError
from planner.adaptive.strip import Strip
from planner.adaptive.strip_plan import StripPlan, plan_strip
from planner.adaptive.surroundings import Surroundings
from planner.adaptive.transfer import Stance, Transfer, Transfers, move_time_s
from planner.cell.obstacles import Obstacle
from planner.defaults import DEFAULT_PLANNER
from planner.errors import PlannerError
from planner.execution.clear_path import nearest_turns
from planner.execution.run_input import RunInput
from planner.execution.run_record import Record
from planner.execution.run_verification import RunVerification, verify_run
from planner.kinematics.configuration import Configuration
from planner.planning.planners import PLANNERS
from planner.scanning.latched_run import LatchedRun
from planner.scanning.scan_run import ScanOptions, TableAtPort, check_motion, run_on_table
from protocol import TableError
from protocol.program.progress import Progress
from protocol.trapezoid import MotionCommand, ReferenceState, time_to_rest_s

# Share of the map's minimum clearance that has to be kept between strips.
_CLEARANCE_SHARE = 0.5


@dataclass(frozen=True, eq=False)
class ScannedStrip:
    """A strip that was scanned.

    Attributes:
        plan: The strip with its motion.
        transfer: The way to it.
        run: What was latched.
        verification: What the motion came to.
    """

    plan: StripPlan
    transfer: Transfer
    run: LatchedRun
    verification: RunVerification

    @property
    def duration_s(self) -> float:
        """How long the way to it and its motion take together."""
        motion = self.plan.motion
        return self.transfer.duration_s + motion.end_s - motion.start_s


class TableCarrier:
    """Scans strips on one table.

    Attributes:
        scanned: The strips that were scanned, in their order.
    """

    def __init__(
        self,
        surroundings: Surroundings,
        table: TableAtPort,
        options: ScanOptions,
        measure: Callable[[RunInput, LatchedRun], Returned],
    ) -> None:
        """Take over a table at angle 0; the arm stands in a clear posture, before the predefined path too.

        Args:
            surroundings: The cell.
            table: The table at its port.
            options: How strips are scanned.
            measure: What the probe returns along a strip that was run.
        """
        self._surroundings, self._table, self._options, self._measure = surroundings, table, options, measure
        best = options.configuration == "best"
        self._configurations = list(Configuration) if best else [Configuration.parse(options.configuration)]
        self._stance: Stance | None = None
        self._table_deg = 0.0
        self._transfers: tuple[Obstacle, Transfers] | None = None
        self._plans: dict[Strip, StripPlan | str] = {}
        self._planned_past: Obstacle | None = None
        self.scanned: list[ScannedStrip] = []

    def ordered(self, strips: Sequence[Strip], solid: Obstacle) -> Sequence[Strip]:
        """Return the strips in the order of the quickest tour; those without a plan come last, to be refused."""
        planned = [self._planned(strip, solid) for strip in strips]
        able = [k for k, each in enumerate(planned) if isinstance(each, StripPlan)]
        ends = [end for each in planned if isinstance(each, StripPlan) for end in self._ends(each.planned)]
        ends_s = np.array([[self._travel_s(a, b) for b in ends] for a in ends]).reshape(len(ends), len(ends))
        from_start_s = np.array([self._travel_s(self._stance, end) for end in ends])
        tour = best_tour(travel_times(ends_s, from_start_s))
        visited = [strips[able[visit.strip]] for visit in tour]
        directed = [each.reversed() if visit.is_reversed else each for each, visit in zip(visited, tour, strict=True)]
        return [*directed, *(strip for k, strip in enumerate(strips) if k not in able)]

    def scan(self, strip: Strip, solid: Obstacle) -> Returned | str:
        """Scan one strip, and return what the probe returned, or why it cannot be scanned; see `Carrier`."""
        planned = self._planned(strip, solid)
        if isinstance(planned, str):
            return planned
        planned = planned.turned(nearest_turns(self._table_deg, float(planned.plan.angles_deg[0])))
        start, end = self._ends(planned.planned)
        transfer = self._ways(solid).between(self._stance, start)
        if isinstance(transfer, str):
            return transfer
        try:
            check_motion(planned.planned, self._options)
        except PlannerError as error:
            return str(error)
        try:
            run = run_on_table(self._table, planned.planned, self._options, None)
        except (PlannerError, TableError) as error:
            # The table may have moved, and where it stands is not known: no way from there can be checked.
            raise CarrierError(f"{strip.name}: {error}") from error
        self._stand_at(end)
        self.scanned.append(ScannedStrip(planned, transfer, run, verified(planned.planned, run.record)))
        returned = self._measure(planned.planned, run)
        if run.failure is not None:
            raise CarrierError(f"{strip.name}: {run.failure}")
        return returned

    def scan_path(self, path: RunInput, progress: Progress | None) -> Returned:
        """Scan a predefined path that was checked, as any scan, and return what the probe returned.

        Raises:
            CarrierError: The motion ended early.
        """
        run = run_on_table(self._table, path, self._options, progress)
        self._stand_at(self._ends(path)[1])
        returned = self._measure(path, run)
        if run.failure is not None:
            raise CarrierError(run.failure)
        return returned

    def draw_back(self, solid: Obstacle) -> Transfer | None:
        """Return the way to a clear posture after the last strip; None where there is none, or the arm is there."""
        if self._stance is None:
            return None
        transfer = self._ways(solid).between(self._stance, None)
        return None if isinstance(transfer, str) else transfer

    def _planned(self, strip: Strip, solid: Obstacle) -> StripPlan | str:
        """Return the plan of a strip, which is kept while the same is solid."""
        if self._planned_past is not solid:
            self._plans, self._planned_past = {}, solid
        if strip not in self._plans:
            planner, angles = PLANNERS[DEFAULT_PLANNER], self._options.angle_count
            self._plans[strip] = plan_strip(self._surroundings, strip, solid, planner, self._configurations, angles)
        return self._plans[strip]

    def _ends(self, planned: RunInput) -> tuple[Stance, Stance]:
        """Return how arm and table stand before a motion, and after it."""
        joints = self._surroundings.cell.arm.joints(planned.joints_deg[[0, -1]])
        names = planned.plan.configurations
        return (
            Stance(joints[0], planned.motion().start_deg, Configuration.parse(names[0])),
            Stance(joints[1], float(planned.plan.angles_deg[-1]), Configuration.parse(names[-1])),
        )

    def _stand_at(self, stance: Stance) -> None:
        self._stance, self._table_deg = stance, stance.table_deg

    def _ways(self, solid: Obstacle) -> Transfers:
        """Return the ways past something solid; searched again when it has changed."""
        if self._transfers is None or self._transfers[0] is not solid:
            cell, value = self._surroundings.cell, self._surroundings.value
            minimum_mm = _CLEARANCE_SHARE * value.minimum_clearance_mm
            check = ContinuousCheck(cell, self._surroundings.collision(solid)[0], solid, minimum_mm)
            self._transfers = solid, Transfers(cell, self._surroundings.limits, check, solid)
        return self._transfers[1]

    def _travel_s(self, start: Stance | None, end: Stance) -> float:
        """Return about how long the way between two stances takes: the slower of table and arm."""
        arm_s = 0.0 if start is None else move_time_s(self._surroundings.cell.arm, start.joints, end.joints)
        from_deg = self._table_deg if start is None else start.table_deg
        from_deg += 360.0 * nearest_turns(end.table_deg, from_deg)
        turn = MotionCommand(end.table_deg, *self._surroundings.limits)
        return max(arm_s, time_to_rest_s(ReferenceState(from_deg, 0.0), turn))


def verified(planned: RunInput, record: Record) -> RunVerification:
    """Return what the motion of a strip came to, from readings of the position and looks into the table.

    Latches are those of the probe's own triggers and not of the strip's poses, so they are left to the alignment.
    """
    seen = [each._replace(column=None) for each in record.observations if each.source != "L"]
    return verify_run(planned, planned.motion(), replace(record, observations=seen), lead_s=0.0)
