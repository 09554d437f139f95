"""Runs with latches, for tests: synthetic ones, and real ones on a table in simulated time."""

import numpy as np

import emulator  # noqa: F401 - teaches pyserial the port emulator://
from planner.arrays import FloatArray
from planner.execution.table_port import open_port
from planner.plans.plan import Plan
from planner.scanning.latched_run import LatchedRun, TriggerConditions, run_latched
from planner.scanning.trigger_line import ProbeOnPort
from planner.table.cost import PathCost
from planner.table.motion import Limits, roll_out
from planner.table.wire import Wire
from protocol import TableClient
from protocol.bench import SimulatedBench, bench_of

LIMITS = Limits(40.0, 100.0)


def swinging_plan(seconds: float = 4.0, acceleration_deg_s2: float = 10.0) -> Plan:
    """Return a plan that turns in one direction and back."""
    step_s = 0.5
    count = int(seconds / step_s)
    signs = np.array([1.0 if k < count // 4 else -1.0 if k < 3 * count // 4 else 1.0 for k in range(count)])
    accelerations = acceleration_deg_s2 * signs
    angles, speeds = roll_out(5.0, 0.0, accelerations, step_s)
    return Plan("", "", step_s, angles, speeds, accelerations, PathCost(0.0, 0.0, 0.0, 0.0))


def joints_along(plan: Plan) -> FloatArray:
    """Return joints that encode the time: a degree per second."""
    times_s = plan.step_s * np.arange(len(plan.angles_deg))
    return np.tile(times_s[:, np.newaxis], (1, 6))


def table_behind(port: object) -> SimulatedBench:
    """Return the simulated table that a port carries."""
    table = bench_of(port)
    assert table is not None
    return table


def latched_run(
    conditions: TriggerConditions, plan: Plan | None = None, decimals: int = 1, query: str = ""
) -> LatchedRun:
    """Return the latched values along a plan on a new table."""
    plan, wire = plan or swinging_plan(), Wire(decimals)
    port = open_port(f"emulator://?decimals={decimals}{query}", wire.baud, 0.5)
    with TableClient(port, 0.5, decimals) as table:
        line = ProbeOnPort(
            table_behind(port), conditions.rate_hz, conditions.delay_s, conditions.faults, conditions.seed
        )
        return run_latched(table, line, plan, joints_along(plan), LIMITS, wire, conditions)
