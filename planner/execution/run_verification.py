"""Verify that the executed motion matches the plan and does not touch forbidden regions."""

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from planner.arrays import FloatArray
from planner.defaults import TOLERANCE_DEG
from planner.execution.clear_path import is_clear
from planner.execution.dead_line import DeadLine, judge_dead_line
from planner.execution.run_input import RunInput
from planner.execution.run_record import Observation, Record
from planner.execution.table_motion import Leg, Phase, TableMotion
from planner.map.config_map import ConfigurationMap
from planner.plans.crossing import crossing_is_allowed
from planner.plans.plan import path_cost
from planner.plans.problem import Problem
from planner.table.cost import PathCost

# A latch with a larger deviation from the plan belongs to an earlier trigger.
_STALE_DEG = 1.0
# In these legs the probe is retracted, or moves to or from the workpiece by the robot's own program.
_WITHOUT_PROBE = frozenset({Phase.RETRACT, Phase.ROTATE, Phase.APPROACH})


class Deviation(NamedTuple):
    """Deviations from the plan, in degrees: at the scan locations, at any time, and on average."""

    at_locations_deg: float
    anywhere_deg: float
    rms_deg: float


class RunVerification(NamedTuple):
    """The results of a run.

    Attributes:
        failure: why the motion was stopped; None if it was completed.
        has_strayed: whether it was stopped because of a position error of the table.
        deviations: deviations of the latched angle, the readings, the inner encoder, the reference and the true angle,
            as far as known. The reference is compared with the commanded plan, which is ahead by the lead.
        located_deg: (n + 1,) the encoder angle at each location, NaN if unknown.
        missing_triggers: locations without their own latch.
        forbidden_steps: steps in which the executed path touched a forbidden cell, with waits and the stop.
        margin_deg: minimum distance of the executed path from a forbidden cell over all locations; infinity if nothing
            is forbidden, NaN if no location is known.
        planned_cost: Eq. (7) of the plan.
        executed_cost: Eq. (7) of the encoder's path, with speeds and accelerations by differences; None if a location
            is unknown.
        latest_command_s: maximum delay of a command.
        tolerance_deg: allowed encoder deviation at a location.
        dead_line: the consequences if the line had failed.
    """

    failure: str | None
    has_strayed: bool
    deviations: dict[str, Deviation]
    located_deg: FloatArray
    missing_triggers: tuple[int, ...]
    forbidden_steps: tuple[int, ...]
    margin_deg: float
    planned_cost: PathCost
    executed_cost: PathCost | None
    latest_command_s: float
    tolerance_deg: float
    dead_line: DeadLine

    @property
    def worst_deg(self) -> float:
        """The maximum deviation of the encoder at a location."""
        encoder = [
            self.deviations[name].at_locations_deg
            for name in ("encoder", "latch", "reading")
            if name in self.deviations
        ]
        return encoder[0] if encoder else float("nan")

    @property
    def is_verified(self) -> bool:
        """Whether the motion was completed, within the tolerance, without touching a forbidden region."""
        return self.failure is None and self.worst_deg <= self.tolerance_deg and not self.forbidden_steps

    @property
    def verdict(self) -> str:
        """The verdict in one sentence."""
        if self.failure is not None:
            return f"stopped: {self.failure}"
        if self.forbidden_steps:
            first, count = self.forbidden_steps[0], len(self.forbidden_steps)
            return f"deviated: a forbidden cell was touched in {count} steps, the first is {first}"
        if not self.worst_deg <= self.tolerance_deg:
            return f"deviated: {self.worst_deg:.3f} deg at a location; allowed: {self.tolerance_deg:g}"
        worst = f"verified: within {self.worst_deg:.3f} deg of the plan at every location"
        true = self.deviations.get("true")
        if true is None or true.at_locations_deg <= self.worst_deg:
            return worst
        return f"{worst} by the encoder, within {true.at_locations_deg:.3f} deg in truth"


def verify_run(
    run_input: RunInput,
    motion: TableMotion,
    record: Record,
    lead_s: float,
    tolerance_deg: float = TOLERANCE_DEG,
) -> RunVerification:
    """Verify a run.

    Args:
        run_input: the plan that was executed, with its map.
        motion: its motion.
        record: the commands and readings.
        lead_s: how early the reference was commanded.
        tolerance_deg: allowed encoder deviation at a location.
    """
    plan, problem = run_input.plan, run_input.problem
    seen = [each for each in record.observations if each.time_s >= 0.0]
    stale = {each.column for each in seen if each.source == "L" and abs(_deviation(motion, each)) > _STALE_DEG}
    series = {
        "reference": _series(seen, "inside", lambda each: each.reference_deg),
        "encoder": _series(seen, "inside", lambda each: each.encoder_deg),
        "true": _series(seen, "inside", lambda each: each.true_deg),
        "latch": _series(seen, "L", lambda each: each.encoder_deg if each.column not in stale else None),
        "reading": _series(seen, "H", lambda each: each.encoder_deg),
    }
    series = {name: each for name, each in series.items() if len(each.times_s)}
    deviations = {
        name: _deviation_of(each, motion, lead_s if name == "reference" else 0.0) for name, each in series.items()
    }
    located = _located(series, motion)
    known = bool(np.isfinite(located).all())
    return RunVerification(
        failure=record.failure,
        has_strayed=record.has_strayed,
        deviations=deviations,
        located_deg=located,
        missing_triggers=_missing(series.get("latch"), len(plan.angles_deg)),
        forbidden_steps=_forbidden_steps(
            run_input, motion, [series[n] for n in ("encoder", "true", "latch", "reading") if n in series]
        ),
        margin_deg=_margin_deg(problem.map, located),
        planned_cost=plan.cost,
        executed_cost=_executed_cost(run_input, motion, located) if known else None,
        latest_command_s=max((sent.late_s for sent in record.sent), default=0.0),
        tolerance_deg=tolerance_deg,
        dead_line=judge_dead_line(problem.map, motion, record),
    )


class _Series(NamedTuple):
    """Angles over time, and the location of each, -1 for none."""

    times_s: FloatArray
    angles_deg: FloatArray
    columns: "np.ndarray[tuple[int], np.dtype[np.int64]]"


def _series(seen: Sequence[Observation], source: str, value: Callable[[Observation], float | None]) -> _Series:
    rows = [
        (each.time_s, angle, -1 if each.column is None else each.column)
        for each in seen
        if each.source == source and (angle := value(each)) is not None
    ]
    times, angles, columns = zip(*rows, strict=True) if rows else ((), (), ())
    return _Series(np.array(times), np.array(angles), np.array(columns, dtype=np.int64))


def _deviation(motion: TableMotion, observation: Observation) -> float:
    return observation.encoder_deg - motion.state_at(observation.time_s).angle_deg


def _deviation_of(series: _Series, motion: TableMotion, lead_s: float) -> Deviation:
    errors = np.abs(series.angles_deg - motion.angles_at(series.times_s + lead_s))
    at_locations = errors[series.columns >= 0]
    if not len(at_locations):  # polled only: a location lies between two readings
        at_locations = errors
    return Deviation(float(at_locations.max()), float(errors.max()), float(np.sqrt(np.mean(errors**2))))


def _located(series: dict[str, _Series], motion: TableMotion) -> FloatArray:
    """Return the encoder angle at the time of each location: the latched one, else interpolated between two readings.

    A trigger that is late by some ms is corrected to its planned time with the planned travel.
    """
    times = motion.column_times_s
    located = np.full(len(times), np.nan)
    if (readings := series.get("reading")) is not None:
        covered = times <= readings.times_s[-1]
        deviation = readings.angles_deg - motion.angles_at(readings.times_s)
        located[covered] = (motion.angles_at(times) + np.interp(times, readings.times_s, deviation))[covered]
    for name in ("latch", "encoder"):
        if (each := series.get(name)) is None:
            continue
        for time_s, angle, column in zip(*each, strict=True):
            if column >= 0:
                way = motion.state_at(times[column]).angle_deg - motion.state_at(time_s).angle_deg
                located[column] = angle + way
    return located


def _missing(latches: _Series | None, count: int) -> tuple[int, ...]:
    there = set() if latches is None else {int(column) for column in latches.columns}
    return tuple(k for k in range(count) if k not in there)


def _forbidden_steps(run_input: RunInput, motion: TableMotion, series: Sequence[_Series]) -> tuple[int, ...]:
    """Return the scan steps in which one of the series touched a forbidden cell; pauses do not count.

    A wait or the stop at a location counts to the step after it, at the last location to the step before it.
    """
    last, touched = len(run_input.plan.accelerations_deg_s2) - 1, set()
    for leg in motion.legs:
        if leg.phase in _WITHOUT_PROBE:
            continue
        for each in series:
            inside = each.angles_deg[(each.times_s >= leg.start_s) & (each.times_s <= leg.end_s)]
            if len(inside) and not _is_allowed(run_input.problem, leg, float(inside.min()), float(inside.max())):
                touched.add(min(leg.column, last))
    return tuple(sorted(touched))


def _is_allowed(problem: Problem, leg: Leg, lowest_deg: float, highest_deg: float) -> bool:
    """Return whether the table may be at the angles of an interval during a leg."""
    if leg.phase is Phase.SCAN:
        return bool(crossing_is_allowed(problem.terms.runs, leg.column, lowest_deg, highest_deg))
    return is_clear(problem.map, leg.column, lowest_deg, highest_deg)


def _margin_deg(configuration_map: ConfigurationMap, located_deg: FloatArray) -> float:
    """Return the minimum distance to a forbidden cell. Its edge is one sample before the forbidden sample."""
    known = [(location, float(angle_deg)) for location, angle_deg in enumerate(located_deg) if np.isfinite(angle_deg)]
    ways_deg = (configuration_map.forbidden_distance_deg(*place) for place in known)
    return min(ways_deg, default=np.nan) - configuration_map.angle_step_deg


def _executed_cost(run_input: RunInput, motion: TableMotion, located_deg: FloatArray) -> PathCost:
    speeds = np.gradient(located_deg, motion.column_times_s)
    accelerations = np.diff(speeds) / np.diff(motion.column_times_s)
    return path_cost(run_input.problem, located_deg, speeds, accelerations, run_input.plan.pauses)
