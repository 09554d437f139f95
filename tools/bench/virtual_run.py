"""Run a plan on a simulated table in virtual time; common to benchmarks and tests."""

import time
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

import emulator  # noqa: F401 - teaches pyserial the port emulator://
from planner.cell.scan import load_scan
from planner.execution.execute import Settings, bring_to, execute
from planner.execution.run_input import RunInput
from planner.execution.run_record import Record
from planner.execution.run_verification import RunVerification, verify_run
from planner.execution.table_motion import TableMotion
from planner.execution.table_port import open_port
from planner.kinematics.arm import Arm
from planner.kinematics.configuration import Configuration
from planner.map.config_map import ConfigurationMap
from planner.map.map_builder import build_maps
from planner.map.map_problem import map_problem
from planner.map.synthetic_maps import MapFamily, synthetic_map
from planner.planning.dynamic_programming import dynamic_programming
from planner.plans.plan import Plan
from planner.plans.problem import Problem
from planner.table.motion import Limits
from planner.table.wire import Wire
from protocol import TableClient
from protocol.bench import bench_of


class VirtualRun(NamedTuple):
    """A run and its duration: in the table's time, and by the wall clock."""

    record: Record
    checked: RunVerification
    simulated_s: float
    real_s: float


def run_in_virtual_time(
    run_input: RunInput, url: str = "emulator://", settings: Settings | None = None, wire: Wire | None = None
) -> VirtualRun:
    """Run a plan on a new table, and verify it."""
    settings, wire = settings or Settings(), wire or Wire()
    limits = run_input.problem.limits
    motion = TableMotion(run_input.plan, limits)
    begin_s = time.perf_counter()
    port = open_port(url, wire.baud, timeout_s=0.5)
    with TableClient(port, timeout_s=0.5, decimals=wire.decimals) as table:
        bring_to(table, motion.start_deg, limits, wire)
        record = execute(table, motion, limits, wire, settings, bench_of(port))
        simulated_s = table.clock.now_s()
    real_s = time.perf_counter() - begin_s
    return VirtualRun(record, verify_run(run_input, motion, record, settings.lead_s), simulated_s, real_s)


def shipped_run_input(name: str) -> RunInput:
    """Return the optimal plan of a shipped scan, in its usual arm configuration."""
    scan = load_scan(name)
    configuration = Configuration.parse("LEFTY-ABOVE-NOFLIP")
    configuration_map = build_maps(map_problem(scan), [configuration], 360)[configuration]
    limits = Limits(scan.limits.speed_deg_s, scan.limits.acceleration_deg_s2)
    problem = Problem(configuration_map, scan.path.step_s, limits)
    run_input = _run_input(name, problem, problem)
    assert run_input is not None, f"the shipped scan {name} can be planned"
    return run_input


def random_run_inputs(count: int, margin: int = 1, step_s: float = 0.1) -> Iterator[RunInput]:
    """Yield plans across random maps of several kinds; maps without a plan are skipped.

    Args:
        count: number of plans.
        margin: samples by which the forbidden regions are widened for planning, so that the motion may deviate.
        step_s: time from one location to the next.
    """
    seed = 0
    while count:
        family = MapFamily(forbidden=0.35 + 0.05 * (seed % 5), slope=(0.0, 0.4, -0.8)[seed % 3], angle_count=360,
                           obstacle_size=8.0)  # fmt: skip
        configuration_map = synthetic_map(family, seed)
        problem = Problem(configuration_map, step_s)
        asked = Problem(widened(configuration_map, margin), step_s)
        run_input = _run_input(f"random map {seed}", asked, problem)
        if run_input is not None:
            yield run_input
            count -= 1
        seed += 1


def widened(configuration_map: ConfigurationMap, samples: int) -> ConfigurationMap:
    """Return the map with its forbidden regions widened along the angle by some samples."""
    allowed = configuration_map.allowed
    for shift in range(-samples, samples + 1):
        allowed = allowed & np.roll(configuration_map.allowed, shift, axis=1)
    return ConfigurationMap(np.where(allowed, configuration_map.values, 0.0))


def _run_input(name: str, asked: Problem, problem: Problem) -> RunInput | None:
    """Return the plan of the problem `asked`, for verification with `problem`; None if there is no plan."""
    plan = dynamic_programming(asked)
    return (
        RunInput(name, plan, problem, np.zeros((len(plan.angles_deg), 6)), Arm.load())
        if isinstance(plan, Plan)
        else None
    )
