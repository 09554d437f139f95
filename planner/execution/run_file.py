"""The files of a run: `run.json` (commands and results) and `run.csv` (readings of the table).

Copies of plan and map are stored with them, so that the folder is complete, and the motion of the robot as `robot.csv`
and `robot.json`. Each file appears when it is complete.
"""

import csv
import io
import json
import shutil
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from planner.defaults import REPORT_FILE
from planner.errors import PlannerError
from planner.execution.robot_motion import RobotMotion
from planner.execution.run_input import RunInput, load_run_input
from planner.execution.run_record import Correction, Observation, Record, Sent
from planner.execution.run_verification import RunVerification
from planner.execution.table_motion import PauseTimes, Phase, TableMotion
from planner.map.map_file import MAP_FILE
from planner.plans.plan_file import PLAN_FILE
from planner.table.wire import Wire
from protocol.files.data_file import DataFileError, read_json
from protocol.files.whole_file import whole_file, write_whole
from protocol.program.command_line import program_name
from protocol.trapezoid import MotionCommand

_FORMAT = "seventh-axis run"
_FORMAT_VERSION = 1
RUN_FILE, SEEN_FILE = "run.json", "run.csv"
RUN_RESULTS = (RUN_FILE, SEEN_FILE, "run.png", "robot.csv", "robot.json", REPORT_FILE)
"""The files that a run and its page write to a folder, besides the copies of plan and map."""


class RunFileError(PlannerError):
    """A folder that contains no run, or a damaged one."""


class RunConditions(NamedTuple):
    """The conditions of a run.

    Attributes:
        port: URL of the port.
        wire: properties of the serial line.
        lead_s: how early the commands took effect.
        tolerance_deg: allowed encoder deviation at a location.
        turns: full turns of the table added to the plan.
        pause_times: duration of the robot's actions in a pause.
        run_on_deg: maximum angle that the table was allowed to run on if the line failed; None in a run of an earlier
            version.
        begun: date and time of the start; None in simulated time.
    """

    port: str
    wire: Wire
    lead_s: float
    tolerance_deg: float
    turns: int
    pause_times: PauseTimes
    run_on_deg: float | None = None
    begun: str | None = None


class StoredRun(NamedTuple):
    """A run that was read from its files."""

    run_input: RunInput
    conditions: RunConditions
    motion: TableMotion
    record: Record


def save_run(
    folder: Path,
    run_input: RunInput,
    conditions: RunConditions,
    motion: TableMotion,
    record: Record,
    verification: RunVerification,
) -> None:
    """Write `run.json` and `run.csv`; angles are as in the protocol, in degrees."""
    document = {
        "format": _FORMAT,
        "format_version": _FORMAT_VERSION,
        "scan": run_input.name,
        "verdict": verification.verdict,
        "verified": verification.is_verified,
        "failure": record.failure,
        "has_strayed": record.has_strayed,
        "conditions": conditions._asdict()
        | {"wire": conditions.wire._asdict(), "pause_times": conditions.pause_times._asdict()},
        "deviations": {name: each._asdict() for name, each in verification.deviations.items()},
        "encoder_at_locations_deg": [_finite(angle) for angle in verification.located_deg],
        "missing_triggers": verification.missing_triggers,
        "forbidden_steps": verification.forbidden_steps,
        "margin_deg": _finite(verification.margin_deg),
        "cost": {
            "planned": verification.planned_cost._asdict() | {"total": verification.planned_cost.total},
            "executed": verification.executed_cost
            and verification.executed_cost._asdict() | {"total": verification.executed_cost.total},
        },
        "latest_command_s": verification.latest_command_s,
        "dead_line": verification.dead_line._asdict(),
        "corrections": [each._asdict() for each in record.corrections],
        "commands": [sent._asdict() | {"command": sent.command._asdict()} for sent in record.sent],
    }
    write_whole(folder / RUN_FILE, json.dumps(document, indent=1, allow_nan=False) + "\n")
    rows = [
        (*_plain(observation), round(motion.state_at(observation.time_s).angle_deg, 6))
        for observation in record.observations
    ]
    write_whole(folder / SEEN_FILE, _table((*Observation._fields, "planned_deg"), rows))


def save_robot(folder: Path, robot: RobotMotion, record: Record) -> None:
    """Write the joint path, and the joints at each trigger, as `robot.csv` and `robot.json`."""
    names = [f"joint_{j}_deg" for j in range(1, 7)]
    samples = zip(robot.times_s.tolist(), robot.columns, robot.phases, robot.joints_deg.tolist(), strict=True)
    rows = [(time_s, column, phase, *joints) for time_s, column, phase, joints in samples]
    write_whole(folder / "robot.csv", _table(("time_s", "column", "phase", *names), rows))
    latched = [
        {"column": each.column, "time_s": each.time_s, "joints_deg": robot.joints_at(each.time_s).round(6).tolist()}
        for each in record.observations
        if each.source == "L"
    ]
    document = {
        "path": [dict(zip(("time_s", "column", "phase", *names), row, strict=True)) for row in rows],
        "latched": latched,
    }
    write_whole(folder / "robot.json", json.dumps(document, indent=1) + "\n")


def copy_input(folder: Path, plan_file: Path, map_file: Path) -> None:
    """Copy plan and map to the folder of the run, unless they are already there."""
    for source, name in ((plan_file, PLAN_FILE), (map_file, MAP_FILE)):
        target = folder / name
        if not (target.exists() and target.samefile(source)):
            with whole_file(target) as partial:
                shutil.copyfile(source, partial)


def load_run(folder: Path) -> StoredRun:
    """Return the run in a folder.

    Raises:
        PlannerError: the folder contains no run, or it is damaged.
    """
    try:
        document = read_json(folder / RUN_FILE)
        if (document["format"], document["format_version"]) != (_FORMAT, _FORMAT_VERSION):
            raise RunFileError(f"{folder / RUN_FILE}: is not a run of format version {_FORMAT_VERSION}")
        conditions = _conditions(document["conditions"])
        record = Record(
            sent=[_sent(each) for each in document["commands"]],
            observations=_observations(folder / SEEN_FILE),
            corrections=[Correction(**each) for each in document["corrections"]],
            failure=document["failure"],
            has_strayed=document["has_strayed"],
        )
    except OSError as error:
        raise RunFileError(
            f"{folder}: contains no run ({error.strerror or error}); {program_name('planner')} run writes one"
        ) from error
    except DataFileError as error:
        raise RunFileError(f"{error}; {program_name('planner')} run writes a folder with {RUN_FILE}") from error
    except (ValueError, KeyError, TypeError, AttributeError, OverflowError, csv.Error) as error:
        raise RunFileError(f"{folder}: its run is damaged: {type(error).__name__}, {error}") from error
    run_input = load_run_input(folder / PLAN_FILE).turned(conditions.turns)
    motion = run_input.motion(conditions.pause_times)
    return StoredRun(run_input, conditions, motion, record)


def _conditions(stored: dict[str, Any]) -> RunConditions:
    return RunConditions(
        **stored | {"wire": Wire(**stored["wire"]), "pause_times": PauseTimes(**stored["pause_times"])}
    )


def _sent(stored: dict[str, Any]) -> Sent:
    return Sent(**stored | {"phase": Phase(stored["phase"]), "command": MotionCommand(**stored["command"])})


def _observations(file: Path) -> list[Observation]:
    with file.open(encoding="utf-8", newline="") as lines:
        return [_observation(row) for row in csv.DictReader(lines)]


def _observation(row: dict[str, str]) -> Observation:
    def number(name: str) -> float | None:
        return float(row[name]) if row[name] else None

    return Observation(
        float(row["time_s"]),
        row["source"],
        float(row["encoder_deg"]),
        int(row["column"]) if row["column"] else None,
        number("reference_deg"),
        number("true_deg"),
    )


def _plain(observation: Observation) -> tuple[object, ...]:
    return tuple(round(value, 6) if isinstance(value, float) else value for value in observation)


def _finite(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None


def _table(header: Sequence[str], rows: Iterable[Sequence[object]]) -> str:
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(header)
    writer.writerows(rows)
    return text.getvalue()
