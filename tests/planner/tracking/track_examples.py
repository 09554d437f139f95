"""A short scan to track, and the locations of its path as a program sends them."""

import json
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np

from planner.arrays import FloatArray
from planner.cell.scan import Scan, load_scan
from planner.defaults import SCANS
from planner.kinematics.arm import Arm
from planner.kinematics.configuration import Configuration
from planner.map.map_problem import map_problem
from planner.table.motion import Limits
from planner.table.wire import Wire
from planner.tracking.online_planner import Step
from planner.tracking.tracker import Tracked, Tracker, TrackSettings

LOCATIONS = 24
CONFIGURATION = Configuration.LEFTY_ABOVE_NOFLIP
ANGLES = 72


@cache
def cylinder() -> Scan:
    """Return the shipped scan of a cylinder."""
    return load_scan("cylinder")


def locations(count: int = LOCATIONS) -> FloatArray:
    """Return the first locations of its path, (count, 4, 4)."""
    return cylinder().path.T_WS[:count]


def lines(T_WS: FloatArray, end: bool = True) -> list[str]:
    """Return locations as a program sends them."""
    sent = [json.dumps(row) for row in T_WS.reshape(-1, 16).tolist()]
    return [*sent, '"end"'] if end else sent


def write_scan(folder: Path, step_s: float = 0.5) -> Path:
    """Write a scan of the first locations, and return its file."""
    rows = locations().reshape(-1, 16).tolist()
    (folder / "path.csv").write_text("\n".join(",".join(map(repr, row)) for row in rows) + "\n", encoding="utf-8")
    text = (SCANS / "cylinder.toml").read_text(encoding="utf-8")
    before, _, after = text.partition("[path]")
    rest = after[after.index("\n[") :] if "\n[" in after else ""
    file = folder / "short.toml"
    file.write_text(f'{before}[path]\ntime_step_s = {step_s}\nfile = "path.csv"\n{rest}', encoding="utf-8")
    return file


def new_tracker(
    view: int = 8, step_s: float | None = None, arm: Arm | None = None, limits: Limits | None = None
) -> Tracker:
    """Return a tracker of the cylinder in one configuration, on a coarse map."""
    scan, problem = cylinder(), map_problem(cylinder())
    if arm is not None:
        problem = replace(problem, cell=replace(problem.cell, arm=arm))
    settings = TrackSettings(view=view)
    return Tracker(
        problem,
        step_s or scan.path.step_s,
        limits or scan.limits,
        scan.weights,
        Wire(),
        settings,
        [CONFIGURATION],
        ANGLES,
    )


def begun_tracker(
    T_WS: FloatArray,
    view: int = 8,
    arm: Arm | None = None,
    ends: bool = True,
    limits: Limits | None = None,
    step_s: float | None = None,
) -> Tracker:
    """Return a tracker that rests at the start and has its first view; with all in view, the path ends or goes on."""
    tracker = new_tracker(view, step_s, arm, limits)
    for T in T_WS[: tracker.room]:
        tracker.reveal(T)
    if ends and tracker.count == len(T_WS):
        tracker.end()
    tracker.begin(tracker.choose_start())
    return tracker


def asked(tracker: Tracker) -> Tracked | None:
    """Ask a tracker for its next command in time, and send it in time."""
    begin_s = tracker.begin_s(Wire(), None)
    tracked = tracker.next(np.inf if begin_s is None else begin_s)
    if tracked is not None:
        tracker.sent(tracked.command, 0.0)
    return tracked


def steps_to_the_end(tracker: Tracker, T_WS: FloatArray) -> list[Step]:
    """Track a path whose locations come as soon as there is room, and return the steps."""
    steps: list[Step] = []
    while True:
        for T in T_WS[tracker.count : tracker.count + tracker.room]:
            tracker.reveal(T)
        if tracker.count == len(T_WS):
            tracker.end()
        tracked = asked(tracker)
        if tracked is None:
            return steps
        if tracked.step is not None:
            steps.append(tracked.step)
