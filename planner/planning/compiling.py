"""Compile the default planner's machine code in a second process while this one computes maps.

On a new machine, or after a change of a kernel, a plan has to wait for its kernels. Those of the map and those of the
planner take about the same time, and numba compiles sequentially within a process.
"""

import subprocess
from collections.abc import Callable, Iterator
from contextlib import contextmanager

import numpy as np

from planner.cell.scan import load_scan
from planner.defaults import DEFAULT_PLANNER
from planner.kinematics.configuration import Configuration
from planner.map.config_map import ConfigurationMap
from planner.planning.dynamic_programming import dynamic_programming
from planner.planning.scan_problem import scan_problem
from planner.plans.arm_motion import arm_motion
from planner.plans.plan import Plan
from planner.plans.verification import verify
from planner.search.lattice_cost_to_go import cost_to_go
from protocol.kept_code import is_kept
from protocol.own_program import own_environment, own_program
from protocol.progress import ProgressOf


@contextmanager
def compiling_beside(planner: str, progress: ProgressOf) -> Iterator[Callable[[], None]]:
    """Compile the machine code of a planner if it is not stored yet, and give the function that waits for it."""
    if planner != DEFAULT_PLANNER or is_kept(cost_to_go):
        yield lambda: None
        return
    # After a failure in the second process, this process compiles when the code is needed.
    process = subprocess.Popen(  # noqa: S603  # this file
        own_program(__name__),
        stdin=subprocess.DEVNULL,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        env=own_environment(),
    )

    def wait() -> None:
        show = progress("plan (compiling, once)")
        if show is not None:
            show(0, 1)
        process.wait()
        if show is not None:
            show(1, 1)

    try:
        yield wait
    finally:
        process.kill()
        process.wait()


def compile_default_planner() -> None:
    """Plan once on a map without obstacles, and check the plan as a command does.

    The types are those of any other scan.
    """
    scan, configuration = load_scan("cylinder"), Configuration.LEFTY_ABOVE_NOFLIP
    free = np.full((len(scan.path.T_WS), 36), 0.5)
    problem = scan_problem(scan, ConfigurationMap(free, metadata={"configuration": configuration.label}))
    plan = dynamic_programming(problem)
    assert problem.arm is not None
    assert isinstance(plan, Plan)
    arm_motion(problem.arm, plan)
    verify(problem, plan)


if __name__ == "__main__":
    compile_default_planner()
