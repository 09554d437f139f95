"""The computing time of a configuration map and its growth, compared with py-opw-kinematics and coal."""

import resource
import subprocess
import sys
from collections.abc import Callable
from dataclasses import replace
from typing import TextIO

import coal
import numpy as np
from py_opw_kinematics import KinematicModel, Robot

from planner.arrays import FloatArray
from planner.cell.scan import load_scan
from planner.defaults import shipped_scans
from planner.geometry.capsule import segment_distance
from planner.kernel import kernel
from planner.kinematics.arm import Arm
from planner.kinematics.configuration import Configuration
from planner.kinematics.inverse_kinematics import inverse_kinematics
from planner.map.map_builder import build_maps
from planner.map.map_problem import MapProblem, map_problem
from protocol.program.own_program import own_environment, own_program
from tools.bench.timing import median_s, print_table

POSES = 20_000
CAPSULE_PAIRS = 20_000
ALL = tuple(Configuration)


def bench(stream: TextIO) -> None:
    """Print all measurements of inverse kinematics, distances and maps."""
    _bench_kinematics(stream)
    _bench_distances(stream)
    _bench_maps(stream)
    _bench_growth(stream)


def _bench_kinematics(stream: TextIO) -> None:
    arm = Arm.load()
    rng = np.random.default_rng(0)
    joints = rng.uniform(arm.limits[0], arm.limits[1], (POSES, 6))
    poses = arm.flange_poses(joints)
    robot = _opw(arm)
    rigid = robot.batch_forward(joints)
    rates = {
        "ours, arrays in and out": POSES / median_s(lambda: inverse_kinematics(arm, poses)),
        "py-opw-kinematics, arrays in and out": POSES / median_s(lambda: robot.reach(rigid)),
    }
    _print_rates(stream, "Inverse kinematics, all eight solutions", "poses/s", rates)


def _opw(arm: Arm) -> Robot:
    model = KinematicModel(
        a1=arm.a_mm[0],
        a2=arm.a_mm[2],
        b=0.0,
        c1=arm.d_mm[0],
        c2=arm.a_mm[1],
        c3=arm.d_mm[3],
        c4=arm.d_mm[5],
        offsets=(0, -np.pi / 2, np.pi / 2, 0, 0, 0),
    )
    return Robot(model, degrees=False)


def _bench_distances(stream: TextIO) -> None:
    rng = np.random.default_rng(0)
    ends = rng.uniform(-300.0, 300.0, (CAPSULE_PAIRS, 4, 3))
    rates = {
        "ours, in a kernel": CAPSULE_PAIRS / median_s(lambda: _least_distance(ends)),
        "coal, a call per pair": CAPSULE_PAIRS / median_s(_coal_distances(ends)),
    }
    _print_rates(stream, "Distance of two capsules", "pairs/s", rates)


@kernel
def _least_distance(ends: FloatArray) -> float:
    least = np.inf
    for i in range(len(ends)):
        e = ends[i]
        distance = segment_distance(
            e[0, 0], e[0, 1], e[0, 2], e[1, 0], e[1, 1], e[1, 2], e[2, 0], e[2, 1], e[2, 2], e[3, 0], e[3, 1], e[3, 2]
        )
        least = min(least, distance)
    return least


def _coal_distances(ends: FloatArray) -> Callable[[], object]:
    """Return a function that computes each distance with coal; its objects are created in advance."""
    lengths = np.linalg.norm(ends[:, 1::2] - ends[:, ::2], axis=2)
    middles = (ends[:, 1::2] + ends[:, ::2]) / 2
    directions = (ends[:, 1::2] - ends[:, ::2]) / lengths[:, :, None]
    up = np.array([0.0, 0.0, 1.0])
    placed = [
        [
            (
                coal.Capsule(1.0, lengths[i, side]),
                coal.Transform3s(coal.Quaternion.FromTwoVectors(up, directions[i, side]).matrix(), middles[i, side]),
            )
            for side in range(2)
        ]
        for i in range(len(ends))
    ]
    request, result = coal.DistanceRequest(), coal.DistanceResult()

    def ask() -> None:
        for (first, first_pose), (second, second_pose) in placed:
            result.clear()
            coal.distance(first, first_pose, second, second_pose, request, result)

    return ask


def _bench_maps(stream: TextIO) -> None:
    rows = []
    for name in shipped_scans():
        problem = _with_locations(map_problem(load_scan(name)), 100)
        whole_s = median_s(lambda problem=problem: build_maps(problem, ALL, 100))  # type: ignore[misc]  # a default argument
        bare = replace(problem, value=problem.value.only(()))
        bare_s = median_s(lambda problem=bare: build_maps(problem, ALL, 100))  # type: ignore[misc]  # a default argument
        rows.append((name, f"{whole_s * 1e3:.1f}", f"{bare_s * 1e3:.1f}", f"{whole_s / 80_000 * 1e9:.0f}"))
    header = ("100 locations x 100 angles x 8 configurations", "ms", "ms, no factors", "ns/cell")
    print_table(stream, "Configuration maps, one core", header, rows)


def _bench_growth(stream: TextIO) -> None:
    rows = []
    for locations, angles in ((100, 100), (1000, 100), (100, 1440), (1000, 1440)):
        answer = subprocess.run(
            own_program("tools.bench.map", str(locations), str(angles)),
            check=True,
            capture_output=True,
            text=True,
            env=own_environment(),
        )
        seconds, peak_mb = (float(number) for number in answer.stdout.split())
        cells = 8 * locations * angles
        rows.append(
            (
                f"{locations} x {angles} x 8",
                f"{seconds * 1e3:,.0f}",
                f"{seconds / cells * 1e9:.0f}",
                f"{cells * 9 / 1e6:.1f}",
                f"{peak_mb:.1f}",
            )
        )
    header = ("scan `mould`: locations x angles", "ms", "ns/cell", "MB of values and reasons", "MB more at the peak")
    print_table(stream, "Growth, each in a fresh process", header, rows)


def _measure_growth(locations: int, angles: int) -> None:
    """Print the time of one map and the increase of this process's peak memory."""
    problem = _with_locations(map_problem(load_scan("mould")), locations)
    build_maps(_with_locations(problem, 2), ALL, 8)  # loads the machine code
    before = _peak_mb()
    build_maps(problem, ALL, angles)
    peak = _peak_mb() - before
    print(median_s(lambda: build_maps(problem, ALL, angles), runs=3), peak)


def _peak_mb() -> float:
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024


def _with_locations(problem: MapProblem, count: int) -> MapProblem:
    """Return the problem with the given number of locations, evenly selected, some repeated if necessary."""
    chosen = np.linspace(0, len(problem.T_WS) - 1, count).round().astype(int)
    return replace(problem, T_WS=problem.T_WS[chosen])


def _print_rates(stream: TextIO, title: str, unit: str, rates: dict[str, float]) -> None:
    ours, peer = rates.values()
    rows = [(name, f"{rate:,.0f}", f"{rate / peer:,.1f}") for name, rate in rates.items()]
    print_table(stream, f"{title} (ours over the peer: {ours / peer:,.1f})", ("", unit, "over the peer"), rows)


if __name__ == "__main__":
    if len(sys.argv) > 1:
        _measure_growth(*map(int, sys.argv[1:]))
    else:
        bench(sys.stdout)
