"""Measure the planners: compared with the optimum of exact lattices and with scipy's Dijkstra, and their growth."""

import ctypes
import gc
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import NamedTuple, TextIO

import numpy as np

from planner.cell.scan import load_scan
from planner.defaults import shipped_scans
from planner.kinematics.configuration import Configuration
from planner.map.map_builder import build_maps
from planner.map.map_problem import map_problem
from planner.map.synthetic_maps import MapFamily, synthetic_map
from planner.planning.dijkstra import shortest_path
from planner.planning.dynamic_programming import dynamic_programming
from planner.planning.planners import PLANNERS
from planner.planning.ray_shooting import Rays, ray_shooting
from planner.planning.receding import FAST_SPEED_COUNT, SPEED_COUNT, online_step, prepare_online_step, receding
from planner.planning.scan_problem import scan_problem
from planner.planning.smoothing import smooth
from planner.plans.plan import Outcome, Plan, Planner
from planner.plans.problem import Problem
from planner.plans.verification import verify
from planner.search.cost_to_go import cost_to_go, lay_out_columns
from planner.search.lattice_choice import turn_lattice
from planner.search.lattice_cost_to_go import cost_to_go as lattice_cost_to_go
from planner.search.state_grid import Grid
from planner.table.motion import Limits
from tools.bench.default_planner import bench_default_planner, lattice_optimum
from tools.bench.planner_families import FAMILIES

# All planners are compared on the first families, on which ray shooting finds plans.
COMPARED_FAMILIES = 11


def smoothed_ray_shooting(problem: Problem) -> Outcome:
    """Return the plan of ray shooting, smoothed."""
    outcome = ray_shooting(problem)
    return smooth(problem, outcome) if isinstance(outcome, Plan) else outcome


COMPARED: Mapping[str, Planner] = {
    **{name: PLANNERS[name] for name in ("dynamic_programming", "receding", "guided_ray_shooting", "ray_shooting")},
    "receding, fast grid": partial(receding, speed_count=FAST_SPEED_COUNT),
    "ray_shooting+smoothing": smoothed_ray_shooting,
}


class Tally(NamedTuple):
    """The results of one planner on one family."""

    ratios: list[float]
    touched: list[bool]
    pauses: list[int]
    seconds: list[float]


def bench(stream: TextIO) -> None:
    """Print all measurements of the planners. Times are medians on this machine; compare those of one run."""
    _bench_graph(stream)
    _bench_steps(stream)
    bench_default_planner(stream)
    _bench_families(stream)
    _bench_scans(stream)
    _bench_growth(stream)


def median_seconds(function: Callable[[], object], repeats: int = 15) -> float:
    """Return the median time of a call, after a first call that compiles."""
    function()
    times = []
    for _ in range(repeats):
        before = time.perf_counter()
        function()
        times.append(time.perf_counter() - before)
    return float(np.median(times))


def peak_memory_mb(function: Callable[[], object]) -> float:
    """Return the increase of this process's peak resident memory by a call (Linux)."""
    gc.collect()
    ctypes.CDLL(None).malloc_trim(0)
    Path("/proc/self/clear_refs").write_text("5", encoding="ascii")
    before = _status_mb("VmRSS")
    result = function()
    peak = _status_mb("VmHWM")
    del result
    return max(peak - before, 0.0)


def _status_mb(key: str) -> float:
    lines = Path("/proc/self/status").read_text(encoding="ascii").splitlines()
    return next(float(line.split()[1]) / 1024.0 for line in lines if line.startswith(key))


def _bench_graph(stream: TextIO) -> None:
    # At 4.5 s per step, multiples of 0.8 deg/s end each step on a node: 50 speeds in each direction, 10 changes of
    # speed.
    problem = Problem(synthetic_map(MapFamily(0.2, 5.0), seed=1), 4.5, Limits(40.0, 8.0 / 4.5))
    lattice = turn_lattice(problem, 50, 1_000_000)
    assert lattice is not None
    grid = Grid(100, 0.0, 0.8, 50, np.arange(-10, 11))
    interpolated_seconds = median_seconds(partial(cost_to_go, problem, grid))
    ours = partial(lattice_cost_to_go, problem.terms, lattice)
    scipys = partial(shortest_path, problem, lattice)
    seconds, megabytes = median_seconds(ours), peak_memory_mb(ours)
    before = time.perf_counter()
    scipy_megabytes = peak_memory_mb(scipys)
    scipy_seconds = time.perf_counter() - before
    speeds = 2 * lattice.half_count + 1
    print(
        f"\nThe paper's graph: 100 columns x {lattice.q_count} angles x {speeds} speeds, 21 accelerations", file=stream
    )
    print(f"  cost-to-go, interpolated       {interpolated_seconds * 1e3:8.2f} ms", file=stream)
    print(f"  cost-to-go, lattice            {seconds * 1e3:8.2f} ms {megabytes:8.1f} MB", file=stream)
    print(f"  scipy csgraph, graph and path  {scipy_seconds * 1e3:8.0f} ms {scipy_megabytes:8.0f} MB", file=stream)
    print(f"  ratio                          {scipy_seconds / seconds:8.0f}", file=stream)


def _bench_steps(stream: TextIO) -> None:
    problem = Problem(synthetic_map(MapFamily(0.1, 6.0), seed=2), step_s=0.25)
    rays = median_seconds(partial(ray_shooting, problem, Rays(21, 30)), 50) / problem.step_count
    print("\nOne step", file=stream)
    print(f"  ray shooting, 21 rays x 30 columns     {rays * 1e6:8.1f} us (a whole plan / its steps)", file=stream)
    for name, speed_count in (("fast grid", FAST_SPEED_COUNT), ("default", SPEED_COUNT)):
        online = prepare_online_step(problem, speed_count)
        columns = lay_out_columns(problem.terms, online.grid, online.unit)
        step = partial(online_step, problem.terms, online, *columns, 0, 50, 0.0, 0.0)
        seconds = median_seconds(step, 200)
        print(f"  receding, 50 columns in view, {name:9} {seconds * 1e6:8.1f} us", file=stream)


def _bench_families(stream: TextIO) -> None:
    for family in FAMILIES[:COMPARED_FAMILIES]:
        _print_comparison(family.name, [family.problem(seed) for seed in range(family.map_count)], stream)


def _bench_scans(stream: TextIO) -> None:
    for name in shipped_scans():
        scan = load_scan(name)
        maps = build_maps(map_problem(scan), [Configuration.LEFTY_ABOVE_NOFLIP], 100)
        _print_comparison(f"shipped scan {name}", [scan_problem(scan, each, None) for each in maps.values()], stream)


def _print_comparison(name: str, problems: Sequence[Problem], stream: TextIO) -> None:
    tallies = {planner: Tally([], [], [], []) for planner in COMPARED}
    crossable = sum(_tally(problem, tallies) for problem in problems)
    print(f"\n{name}: {crossable} of {len(problems)} maps have a way on the exact lattice", file=stream)
    print("  planner                   ratio: mean    p95    max  touched  pauses  ms/plan", file=stream)
    for planner, tally in tallies.items():
        print(f"  {planner:24}  {_row(tally)}", file=stream)


def _row(tally: Tally) -> str:
    ratios = np.array(tally.ratios) if tally.ratios else np.full(1, np.nan)
    milliseconds = 1e3 * float(np.median(tally.seconds)) if tally.seconds else np.nan
    return (
        f"{ratios.mean():11.4f} {np.percentile(ratios, 95):6.3f} {ratios.max():6.3f} "
        f"{100.0 * float(np.mean(tally.touched or [False])):6.0f} % {sum(tally.pauses):7d} "
        f"{milliseconds:8.2f}"
    )


def _tally(problem: Problem, tallies: dict[str, Tally]) -> bool:
    """Plan one map by all planners from the optimum's start; return whether the lattice has a path."""
    optimum = lattice_optimum(problem)
    if optimum is None:
        return False
    problem = replace(problem, start_angle_deg=float(optimum.angles_deg[0]))
    for name, planner in COMPARED.items():
        planner(problem)
        before = time.perf_counter()
        outcome = planner(problem)
        tallies[name].seconds.append(time.perf_counter() - before)
        if not isinstance(outcome, Plan):
            tallies[name].touched.append(True)
            continue
        tallies[name].touched.append(bool(verify(problem, outcome).forbidden_steps))
        tallies[name].pauses.append(len(outcome.pauses))
        if not outcome.pauses:
            tallies[name].ratios.append(outcome.cost.total / optimum.cost.total)
    return True


def _bench_growth(stream: TextIO) -> None:
    print("\nGrowth of the whole plan (dynamic programming; receding)", file=stream)
    for columns, angles in (
        (100, 100),
        (200, 100),
        (400, 100),
        (100, 200),
        (100, 400),
        (1000, 100),
        (400, 360),
        (1200, 1440),
    ):
        family = MapFamily(0.1, 6.0, location_count=columns, angle_count=angles)
        problem = Problem(synthetic_map(family, 3), step_s=0.25)
        whole = median_seconds(partial(dynamic_programming, problem), 3)
        online = median_seconds(partial(receding, problem), 3)
        print(f"  {columns:5d} columns x {angles:4d} angles  {whole * 1e3:9.2f} ms {online * 1e3:9.2f} ms", file=stream)
    problem = Problem(synthetic_map(MapFamily(0.1, 6.0), 3), limits=Limits(40.0, 80.0))
    print("Growth of the cost-to-go of 100 x 100 with the speeds, 21 accelerations", file=stream)
    for half in (25, 50, 100, 200):
        grid = Grid(100, 0.0, 40.0 / half, half, np.arange(-10, 11))
        seconds = median_seconds(partial(cost_to_go, problem, grid), 5)
        print(f"  {2 * half + 1:5d} speeds {seconds * 1e3:9.2f} ms", file=stream)
