"""The motion of a scan on a table with a triggering probe, and the values latched at each trigger.

This part needs the table, but measures nothing yet. Its result has one row for each profile.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np

from planner.arrays import FloatArray, IndexArray
from planner.defaults import PROFILES_HZ
from planner.errors import PlannerError
from planner.execution.execute import Settings, bring_to, execute
from planner.execution.robot_motion import RobotMotion, robot_motion
from planner.execution.run_record import Record
from planner.execution.table_motion import Phase, TableMotion
from planner.plans.plan import Plan
from planner.scanning.latching import Drop, Pairing, RobotLatch, TableReading, Tolerances, Trigger, pair
from planner.scanning.trigger_line import TableTruth, TriggerFaults, TriggerLine, robot_latch_times_s
from planner.table.motion import Limits
from planner.table.wire import Wire
from protocol import TableClient
from protocol.program.progress import Progress

# Time of the first profile: the first command has been sent by then.
_FIRST_PROFILE_S = 0.06
# Time from a trigger to the reading of its latch.
_READING_AFTER_S = 0.002
# Allowed difference of the table's deviation from its plan between a trigger and its neighbors; the emulator stays
# below half of it.
_TRACKING_DEG = 0.08


class NothingScannedError(PlannerError):
    """A scan in which no profile has both a robot pose and a table angle."""


class TriggerConditions(NamedTuple):
    """Settings of the probe's triggers.

    Attributes:
        rate_hz: profiles per second.
        delay_s: maximum delay of an edge to the robot or to the table (an estimate for optocouplers).
        faults: faults of the triggers.
        seed: random seed of the delays.
    """

    rate_hz: float = PROFILES_HZ
    delay_s: float = 0.0001
    faults: TriggerFaults = TriggerFaults()
    seed: int = 0


@dataclass(frozen=True, eq=False)
class LatchedRun:
    """The `n` profiles with a robot pose and a table angle, and their ground truth.

    Attributes:
        numbers: `(n,)` numbers of the profiles.
        times_s: `(n,)` in the time of the motion.
        joints_deg: `(n, 6)` as latched.
        angles_deg: `(n,)` table angles as transmitted.
        true_joints_deg: `(n, 6)` when the profile was taken.
        true_deg: `(n,)` true angle of the table at that time, from its encoder's zero; the transmitted one if it is
            unknown.
        edge_deg: `(n,)` true angle of the table when its trigger arrived, or as `true_deg`.
        shaft_deg: `(n,)` angle of the motor at that time, divided by the gear ratio, or as `true_deg`.
        latched_deg: `(n,)` encoder angle at that time, before rounding, or as `true_deg`.
        tells_truth: whether the port provides these four.
        triggers: number of profiles that the probe took along the path.
        dropped: why the other profiles have no pose, by their number.
        record: the commands and the readings.
    """

    numbers: IndexArray
    times_s: FloatArray
    joints_deg: FloatArray
    angles_deg: FloatArray
    true_joints_deg: FloatArray
    true_deg: FloatArray
    edge_deg: FloatArray
    shaft_deg: FloatArray
    latched_deg: FloatArray
    tells_truth: bool
    triggers: int
    dropped: dict[int, Drop]
    record: Record

    @property
    def failure(self) -> str | None:
        """Why the motion ended early; None if it was completed."""
        return self.record.failure


def numbered_from(run: LatchedRun, first: int) -> LatchedRun:
    """Return a run whose profiles are numbered from `first` on."""
    dropped = {number + first: drop for number, drop in run.dropped.items()}
    return replace(run, numbers=run.numbers + first, dropped=dropped)


def number_after(run: LatchedRun) -> int:
    """Return the first number that no profile of a run has, dropped ones included."""
    return 1 + max([*run.numbers[-1:].tolist(), *run.dropped], default=-1)


def joined(runs: Sequence[LatchedRun]) -> LatchedRun:
    """Return the profiles of several runs, one after the other; the record is that of the last one."""

    def column(of: Callable[[LatchedRun], FloatArray]) -> FloatArray:
        return np.concatenate([of(run) for run in runs])

    return LatchedRun(
        numbers=np.concatenate([run.numbers for run in runs]),
        times_s=column(lambda run: run.times_s),
        joints_deg=column(lambda run: run.joints_deg),
        angles_deg=column(lambda run: run.angles_deg),
        true_joints_deg=column(lambda run: run.true_joints_deg),
        true_deg=column(lambda run: run.true_deg),
        edge_deg=column(lambda run: run.edge_deg),
        shaft_deg=column(lambda run: run.shaft_deg),
        latched_deg=column(lambda run: run.latched_deg),
        tells_truth=all(run.tells_truth for run in runs),
        triggers=sum(run.triggers for run in runs),
        dropped={number: drop for run in runs for number, drop in run.dropped.items()},
        record=runs[-1].record,
    )


class ReadingMotion(TableMotion):
    """A plan's motion in which the latch is read after each profile, not at each scan location."""

    def __init__(self, plan: Plan, limits: Limits, rate_hz: float) -> None:
        """Create the motion. From `_FIRST_PROFILE_S` on there is a profile in each period of the scan's legs."""
        super().__init__(plan, limits)
        self._rate_hz = rate_hz

    @cached_property
    def column_times_s(self) -> FloatArray:
        """(n,) times of the readings: the first one starts the probe, the others follow their profiles."""
        count = int((self.scan_end_s - _FIRST_PROFILE_S) * self._rate_hz) + 1
        times_s = _FIRST_PROFILE_S + np.arange(max(1, count)) / self._rate_hz
        times_s[1:] += _READING_AFTER_S
        return np.array([time_s for time_s in times_s.tolist() if self.is_scanning(time_s)])

    @property
    def scan_end_s(self) -> float:
        """The time of the last scan location."""
        return max((leg.end_s for leg in self.legs if leg.phase is Phase.SCAN), default=0.0)

    def is_scanning(self, time_s: float) -> bool:
        """Return whether the probe is on its path: not in a pause, and not before the start or after the end."""
        return 0.0 <= time_s <= self.scan_end_s and self.leg_at(time_s).phase is Phase.SCAN


def run_latched(
    table: TableClient,
    line: TriggerLine,
    plan: Plan,
    joints_deg: FloatArray,
    limits: Limits,
    wire: Wire,
    conditions: TriggerConditions,
    settings: Settings | None = None,
    progress: Progress | None = None,
) -> LatchedRun:
    """Execute the motion of a plan with a triggering probe, and return the latched values.

    Args:
        table: the client at the table's port.
        line: the trigger line of the probe.
        plan: the motion of the table.
        joints_deg: `(n + 1, 6)` joints of the robot at the plan's locations.
        limits: maximum S and A.
        wire: properties of the serial line.
        conditions: settings of the probe's triggers.
        progress: called with the time of the motion and its end, in ms.
        settings: settings for the execution.

    Raises:
        NothingScannedError: no profile is complete.
        PlannerError: the serial line is too slow for the commands.
        TableError: the table did not reach the start.
    """
    motion = ReadingMotion(plan, limits, conditions.rate_hz)
    bring_to(table, round(motion.start_deg, wire.decimals), limits, wire)
    settings = settings or Settings()
    record = execute(table, motion, limits, wire, settings, line, progress)
    line.stop()
    times_s = line.times_s() - record.origin_s
    # Triggers in pauses and after the end overwrite the table's latch as well.
    triggers = [Trigger(k, time_s) for k, time_s in enumerate(times_s.tolist())]
    on_path = {trigger.number for trigger in triggers if motion.is_scanning(trigger.time_s)}
    robot = robot_motion(motion, joints_deg)
    latches = _robot_latches(robot, times_s, conditions)
    readings = list(_readings(record, wire))
    # The rounding error is at most half a step of the protocol.
    tolerances = Tolerances(table_deg=_TRACKING_DEG + 0.5 * wire.quantum)
    pairing = pair(
        triggers, latches, readings, lambda at_s: motion.state_at(at_s - settings.encoder_delay_s).angle_deg, tolerances
    ).only(on_path)
    if not len(pairing.numbers):
        raise NothingScannedError(_why_nothing(len(on_path), pairing.dropped, record.failure))
    truth = _truth(line, pairing)
    return LatchedRun(
        numbers=pairing.numbers,
        times_s=times_s[pairing.numbers],
        joints_deg=pairing.joints_deg,
        angles_deg=pairing.angles_deg,
        true_joints_deg=_joints_at(robot, times_s[pairing.numbers]),
        true_deg=truth.exposure_deg,
        edge_deg=truth.edge_deg,
        shaft_deg=truth.shaft_deg,
        latched_deg=truth.latched_deg,
        tells_truth=line.truth() is not None,
        triggers=len(on_path),
        dropped=pairing.dropped,
        record=record,
    )


def _robot_latches(robot: RobotMotion, times_s: FloatArray, conditions: TriggerConditions) -> list[RobotLatch]:
    """Return the values that an ideal robot latches at the triggers that arrive there."""
    at_s = robot_latch_times_s(times_s, conditions.delay_s, conditions.faults, conditions.seed)
    return [RobotLatch(time_s, joints) for time_s, joints in zip(at_s, _joints_at(robot, at_s), strict=True)]


def _truth(line: TriggerLine, pairing: Pairing) -> TableTruth:
    """Return the ground truth of the table at the profiles' triggers.

    It consists of the transmitted values if the port does not provide it.
    """
    truth, wire_deg = line.truth(), pairing.angles_deg
    if truth is None:
        return TableTruth(wire_deg, wire_deg, wire_deg, wire_deg)
    exposure_deg, edge_deg, shaft_deg, latched_deg = (part[pairing.numbers] for part in truth)
    # The table may have missed a trigger in such a slow motion that this is not detectable.
    missed = np.isnan(latched_deg)
    return TableTruth(
        exposure_deg,
        np.where(missed, exposure_deg, edge_deg),
        np.where(missed, exposure_deg, shaft_deg),
        np.where(missed, wire_deg, latched_deg),
    )


def _readings(record: Record, wire: Wire) -> Iterator[TableReading]:
    """Yield the replies to `L`; the ground truth of the table is read between trigger and command."""
    on_the_way_s = wire.seconds(2) + wire.turnaround_s + wire.latency_s
    looked_s = {each.column: each.time_s for each in record.observations if each.source == "inside"}
    for each in record.observations:
        if each.source == "L":
            asked_s = looked_s.get(each.column, each.time_s)
            yield TableReading(asked_s, asked_s + on_the_way_s, each.encoder_deg)


def _joints_at(robot: RobotMotion, times_s: FloatArray) -> FloatArray:
    """Return the joints `(n, 6)` at each time."""
    return np.column_stack([np.interp(times_s, robot.times_s, robot.joints_deg[:, j]) for j in range(6)])


def _why_nothing(triggers: int, dropped: dict[int, Drop], failure: str | None) -> str:
    if failure is not None:
        return f"nothing was scanned: {failure}"
    if not triggers:
        return "nothing was scanned: the probe took no profile; its rate is too low for a scan this short"
    reasons = [drop.value for drop in dropped.values()]
    most = max(set(reasons), key=reasons.count)
    return f"nothing was scanned: all {triggers} profiles were dropped, mostly because {most}"
