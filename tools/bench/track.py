"""The table planned while it moves: decision times, the price of not knowing, withheld locations, long paths, a pty."""

import gc
import json
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple, TextIO

import numpy as np

from planner.__main__ import main as planner_main
from planner.arrays import FloatArray
from planner.cell.scan import Scan, load_scan
from planner.defaults import RAY_SHOOTING, RECEDING, SCANS, shipped_scans
from planner.kinematics.configuration import Configuration
from planner.map.config_map import ConfigurationMap, map_value
from planner.map.map_builder import build_maps
from planner.map.map_problem import map_problem
from planner.map.synthetic_maps import MapFamily, synthetic_map
from planner.planning.own_planners import planner_named
from planner.planning.scan_problem import scan_problem
from planner.plans.plan import Pause, Plan, path_cost
from planner.plans.problem import Problem
from planner.table.motion import Limits
from planner.table.wire import Wire
from planner.tracking.decision import METHODS, costs_of_starts
from planner.tracking.online_planner import Blocked, Kind, OnlinePlanner, State, Step, may_rest
from planner.tracking.revealed_map import RevealedMap
from planner.tracking.tracker import Tracker, TrackSettings
from protocol.program.own_program import own_environment, own_program
from tools.bench.timing import percentile, print_table
from tools.bench.track_plot import plot_views

VIEWS = (10, 20, 50, 100)
WITHHELD = 50
LONG_PATH = 10_000
PTY_S = 600.0
_STEP_S, _MARGIN_DEG, _SUB_STEPS = 0.25, 0.1, 16
_CONFIGURATION = Configuration.LEFTY_ABOVE_NOFLIP
HARD = {
    "5 of 10 forbidden": MapFamily(forbidden=0.5, angle_count=360),
    "fine obstacles": MapFamily(forbidden=0.3, obstacle_size=2.0, angle_count=360),
    "drift": MapFamily(forbidden=0.35, slope=6.0, angle_count=360),
    "fast drift": MapFamily(forbidden=0.3, slope=-9.0, angle_count=360),
}


class Track(NamedTuple):
    """A path that was tracked: its steps, CPU and wall time of each decision, and who decided."""

    steps: list[Step]
    cpu_s: list[float]
    wall_s: list[float]
    tracker: Tracker


def bench(stream: TextIO, pty: bool = False, picture: Path | None = None) -> None:
    """Print every figure of tracking; with `pty` those in real time too; draw cost and pauses into `picture`."""
    _bench_decisions(stream)
    _bench_views(stream, picture)
    _bench_withheld(stream)
    _bench_long_path(stream)
    if pty:
        _bench_pty(stream)


def track(
    scan: Scan,
    T_WS: FloatArray,
    settings: TrackSettings,
    sent_by: Callable[[int], int] = lambda _: sys.maxsize,
    keep: bool = True,
) -> Track:
    """Track a path in simulated time, without a table; `sent_by` returns the number of locations sent by a step."""
    tracker = Tracker(
        map_problem(scan), scan.path.step_s, scan.limits, scan.weights, Wire(), settings, [_CONFIGURATION]
    )
    for T in T_WS[: tracker.room]:
        tracker.reveal(T)
    if tracker.count == len(T_WS):
        tracker.end()
    tracker.begin(tracker.choose_start())
    steps, cpu_s, wall_s, step_number = [], [], [], 0
    gc.collect()
    gc.disable()
    try:
        while (begin_s := tracker.begin_s(Wire(), None)) is not None:
            cpu, wall, count = time.thread_time(), time.perf_counter(), tracker.count
            for T in T_WS[count : min(count + min(tracker.room, 4), sent_by(step_number))]:
                tracker.reveal(T)
            if tracker.count == len(T_WS):
                tracker.end()
            tracked = tracker.next(begin_s)
            if tracked is None:
                break
            if tracked.step is not None:
                if tracker.count - count == 1:
                    cpu_s.append(time.thread_time() - cpu)
                    wall_s.append(time.perf_counter() - wall)
                if keep:
                    steps.append(tracked.step)
                step_number += 1
            tracker.sent(tracked.command, 0.0)
    finally:
        gc.enable()
    return Track(steps, cpu_s, wall_s, tracker)


def cost_of(problem: Problem, steps: list[Step]) -> float:
    """Return Eq. (7) of the steps, waits left out."""
    moving = [step for step in steps if step.kind is not Kind.WAIT]
    pauses = [
        Pause(step.start.location, step.start.angle_deg, step.end.angle_deg)
        for step in moving
        if step.kind is Kind.PAUSE
    ]
    angles = [moving[0].start.angle_deg, *(step.end.angle_deg for step in moving)]
    speeds = [moving[0].start.speed_deg_s, *(step.end.speed_deg_s for step in moving)]
    accelerations = [step.acceleration_deg_s2 for step in moving]
    return path_cost(problem, np.array(angles), np.array(speeds), np.array(accelerations), pauses).total


def _bench_decisions(out: TextIO) -> None:
    rows, every_cpu, every_wall = [], [], []
    for name in shipped_scans():
        scan = load_scan(name)
        T_WS = _longer(scan, 1000)
        one = track(replace(scan), T_WS, TrackSettings(view=50), keep=False)
        every_cpu += one.cpu_s
        every_wall += one.wall_s
        rows.append((name, str(len(one.cpu_s)), *_ms(one.cpu_s), *_ms(one.wall_s)))
    rows.append(("together", str(len(every_cpu)), *_ms(every_cpu), *_ms(every_wall)))
    header = ("scan", "decisions", "CPU median", "99.9 %", "worst", "wall median", "99.9 %", "worst")
    print_table(
        out, "A decision with its new column of 360 angles and its command, 50 columns in view, ms", header, rows
    )


def _ms(times_s: list[float]) -> tuple[str, ...]:
    shares = percentile(times_s, 0.5), percentile(times_s, 0.999), max(times_s)
    return tuple(f"{1000.0 * each:.2f}" for each in shares)


def _longer(scan: Scan, count: int) -> FloatArray:
    """Return a scan's path back and forth until it has the given number of locations."""
    path = scan.path.T_WS
    there_and_back = np.concatenate((path, path[-2:0:-1]))
    return there_and_back[np.arange(count) % len(there_and_back)]


def _bench_views(out: TextIO, picture: Path | None = None) -> None:
    rows, ratios = [], {}
    for name in shipped_scans():
        scan = load_scan(name)
        map_ = build_maps(map_problem(scan), [_CONFIGURATION], 360)[_CONFIGURATION]
        problem = scan_problem(scan, map_)
        best = planner_named("dynamic_programming")(problem)
        assert isinstance(best, Plan)
        for planner in (RECEDING, RAY_SHOOTING):
            tracks = [track(scan, scan.path.T_WS, TrackSettings(planner, view)) for view in VIEWS]
            offline = planner_named(planner)(problem)
            found = [
                (cost_of(problem, each.steps) / best.cost.total, sum(step.kind is Kind.PAUSE for step in each.steps))
                for each in tracks
            ]
            ratios[f"{name}, {planner}"] = found
            known = f"{offline.cost.total / best.cost.total:.3f}" if isinstance(offline, Plan) else "-"
            shown = [f"{ratio:.3f}" + (f" ({pauses})" if pauses else "") for ratio, pauses in found]
            rows.append((f"{name}, {planner}", *shown, known))
    header = ("scan, planner", *(f"{view} in view" for view in VIEWS), "offline")
    print_table(out, "Cost over the optimum with full knowledge and a free start (pauses)", header, rows)
    if picture is not None:
        plot_views(VIEWS, ratios, picture)


def _bench_withheld(out: TextIO) -> None:
    rows = []
    generator = np.random.default_rng(0)
    for name in shipped_scans():
        scan = load_scan(name)
        map_ = build_maps(map_problem(scan), [_CONFIGURATION], 360)[_CONFIGURATION]
        tally = [0, 0, 0, 0]
        for withheld, stall in _withholdings(generator, map_.location_count, WITHHELD):
            sent = _sent_by(withheld, stall)
            one = track(scan, scan.path.T_WS, TrackSettings(view=20), sent)
            _count(tally, map_, one.steps, withheld, scan.path.step_s, one.tracker.state.location)
        rows.append((f"scan {name}", *map(str, tally)))
    for name, family in HARD.items():
        tally = [0, 0, 0, 0]
        for seed, (withheld, stall) in enumerate(_withholdings(generator, family.location_count, WITHHELD)):
            map_ = synthetic_map(family, seed)
            steps, reached = track_map(map_, 20, _sent_by(withheld, stall))
            _count(tally, map_, steps, withheld, _STEP_S, reached)
        rows.append((name, *map(str, tally)))
    header = (
        "locations withheld",
        "runs",
        "not at rest in view",
        "forbidden steps",
        "went on",
    )
    print_table(out, "Locations withheld at random moments, 20 columns in view", header, rows)


def _withholdings(generator: np.random.Generator, count: int, runs: int) -> Iterator[tuple[int, int]]:
    """Yield after how many locations a source stalls, and for how many steps."""
    for _ in range(runs):
        yield int(generator.integers(22, count - 1)), int(generator.integers(1, 60))


def _sent_by(withheld: int, stall: int) -> Callable[[int], int]:
    return lambda step: withheld if step < withheld + stall else sys.maxsize


def _count(
    tally: list[int], map_: ConfigurationMap, steps: list[Step], withheld: int, step_s: float, reached: int
) -> None:
    """Add a run to a tally: runs, motions to rest that do not end in view, forbidden steps, runs to the end."""
    tally[0] += 1
    tally[1] += sum(not step.rest.is_at_rest or step.rest.location > step.last_known for step in steps)
    tally[2] += sum(_touches(map_, step, step_s) for step in steps)
    last = map_.location_count - 1
    tally[3] += reached == last or not map_.allowed[reached + 1].any() or reached > withheld


def _touches(map_: ConfigurationMap, step: Step, step_s: float) -> bool:
    """Return whether a step, or the motion to rest kept after it, meets what is forbidden, by look-ups in the map."""
    state = step.start
    if step.kind is not Kind.SCAN:
        return not map_.is_allowed(step.end.location, step.end.angle_deg)
    moving = [(each.acceleration_deg_s2, each.end) for each in step.kept if not each.halts]
    for acceleration, end in ((step.acceleration_deg_s2, step.end), *moving):
        for share in np.linspace(0.0, 1.0, _SUB_STEPS + 1):
            t = float(share) * step_s
            angle = state.angle_deg + state.speed_deg_s * t + 0.5 * acceleration * t * t
            if map_value(map_.values, map_.epsilon, state.location + float(share), angle) <= map_.epsilon:
                return True
        state = end
    return False


def track_map(
    map_: ConfigurationMap, view: int, sent_by: Callable[[int], int], planner: str = RECEDING
) -> tuple[list[Step], int]:
    """Track a synthetic map without an arm, and return the steps and the last location reached."""
    revealed = RevealedMap(map_.angle_count, _STEP_S, Limits(), None, view)
    for column in map_.values[: view + 1]:
        revealed.reveal(column)
    window = revealed.window(0)
    starts = np.argsort(costs_of_starts(revealed.online, window), kind="stable") * 360.0 / map_.angle_count
    start = next(angle for angle in starts.tolist() if may_rest(window.terms, 0, angle, _MARGIN_DEG))
    online = OnlinePlanner(revealed, METHODS[planner](), State(0, start, 0.0), _MARGIN_DEG, min(view, 10))
    steps: list[Step] = []
    while True:
        while revealed.room and revealed.count < min(sent_by(len(steps)), map_.location_count):
            revealed.reveal(map_.values[revealed.count])
        online.ended = revealed.count == map_.location_count
        if online.is_finished or isinstance(step := online.step(), Blocked):
            return steps, online.state.location
        steps.append(step)


def _bench_long_path(out: TextIO) -> None:
    scan = load_scan("cylinder")
    path = _longer(scan, LONG_PATH)
    generator = np.random.default_rng(0)
    bursts = np.cumsum(generator.integers(0, 8, LONG_PATH))  # stalls and bursts, 3.5 locations a step on average
    before = _resident_kb()
    one = track(scan, path, TrackSettings(view=50), lambda step: int(bursts[min(step, LONG_PATH - 1)]), keep=False)
    tracker = one.tracker
    drift_s = tracker.motion.decided_s - tracker.motion.ticks * scan.path.step_s
    grown_mb = (_resident_kb() - before) / 1024
    rows = [
        (f"{LONG_PATH} locations in bursts", f"{tracker.state.location + 1}", f"{grown_mb:.1f}", f"{drift_s:g}",
         f"{tracker.missed}")
    ]  # fmt: skip
    print_table(out, "A long path", ("source", "reached", "memory grew by MB", "clock drift s", "missed"), rows)


def _resident_kb() -> int:
    status = Path("/proc/self/status").read_text(encoding="ascii")
    return next(int(line.split()[1]) for line in status.splitlines() if line.startswith("VmRSS"))


def _bench_pty(out: TextIO) -> None:
    with tempfile.TemporaryDirectory() as name, _emulator(Path(name) / "control") as port:
        folder, control = Path(name), Path(name) / "control"
        text = (SCANS / "cylinder.toml").read_text(encoding="utf-8")
        length_mm = 30.0 * load_scan("cylinder").path.count * 0.5
        text = text.replace("scan_speed_mm_s = 30", f"scan_speed_mm_s = {length_mm / PTY_S:.3f}")
        scan_file = folder / "slow.toml"
        scan_file.write_text(text.replace("time_step_s = 0.5", "time_step_s = 0.1"), encoding="utf-8")
        command = ["track", str(scan_file), "--port", port, "--control", str(control), "--arm-away"]
        status = planner_main([*command, "--configuration", _CONFIGURATION.label, "--out", str(folder / "out")])
        ran = json.loads((folder / "out" / "run.json").read_text(encoding="utf-8"))
        tracked = json.loads((folder / "out" / "track.json").read_text(encoding="utf-8"))
    times = tracked["decisions"]["time_s"]
    rows = [
        (f"{status}", f"{tracked['decisions']['count']}", f"{tracked['decisions']['missed']}",
         f"{1000.0 * ran['latest_command_s']:.1f}", f"{ran['deviations']['reference']['at_locations_deg']:.4f}",
         *(f"{1000.0 * times[key]:.2f}" for key in ("median", "share_999", "worst")))
    ]  # fmt: skip
    header = (
        "exit status",
        "decisions",
        "missed",
        "latest command ms",
        "reference off deg",
        "ms median",
        "99.9 %",
        "worst",
    )
    print_table(out, f"Steps of 0.1 s at 9600 baud on a pty in real time, {PTY_S:g} s", header, rows)


@contextmanager
def _emulator(control: Path) -> Iterator[str]:
    command = [*own_program("emulator"), "--pty", "--control", str(control)]
    with subprocess.Popen(  # our own program
        command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True, env=own_environment()
    ) as process:
        assert process.stdout is not None
        try:
            yield process.stdout.readline().strip()
        finally:
            process.terminate()
