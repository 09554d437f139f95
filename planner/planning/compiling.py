"""The machine code of a first plan, compiled in two processes.

On a new machine, or after a change of kernels, a plan has to wait for its kernels, and numba compiles sequentially
within a process. So a second process compiles the kernels of the distance field and of the map. Then it compiles those
of the proof that there is no plan. Meanwhile this process compiles the planner's. A process that needs a kernel which
the other one is compiling waits (`made_by_one`).
"""

import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace

import numpy as np
import trimesh

from planner.cell.scan import Scan, load_scan
from planner.defaults import DEFAULT_PLANNER
from planner.geometry.signed_distance_field import build_field
from planner.kinematics.configuration import Configuration
from planner.map.config_map import ConfigurationMap
from planner.map.map_builder import build_maps, is_compiled
from planner.map.map_problem import map_problem
from planner.planning.dynamic_programming import dynamic_programming
from planner.planning.scan_problem import scan_problem
from planner.plans.arm_motion import arm_motion
from planner.plans.plan import Plan
from planner.plans.problem import Problem
from planner.plans.verification import verify
from planner.search.lattice_cost_to_go import cost_to_go
from planner.search.unreachability_proof import first_unreachable_location
from protocol.kernels.kept_code import is_kept
from protocol.program.own_program import own_environment, own_program
from protocol.program.progress import ProgressOf

_ANY = Configuration.LEFTY_ABOVE_NOFLIP


@contextmanager
def compiling_beside(planner: str, progress: ProgressOf) -> Iterator[None]:
    """Compile the default planner here and the map beside it, if neither has been compiled before."""
    if planner != DEFAULT_PLANNER or is_compiled() or is_kept(cost_to_go):
        yield
        return
    # After a failure in the second process, this process compiles when the code is needed.
    process = subprocess.Popen(  # noqa: S603  # this file
        own_program(__name__),
        stdin=subprocess.DEVNULL,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        env=own_environment(),
    )
    try:
        show = progress("plan (compiling, once)")
        if show is not None:
            show(0, 1)
        compile_default_planner()
        if show is not None:
            show(1, 1)
        yield
    finally:
        process.kill()
        process.wait()


def compile_default_planner() -> None:
    """Plan once on a map without obstacles, and check the plan as a command does.

    The types are those of any other scan.
    """
    problem = _free_problem(load_scan("cylinder"))
    plan = dynamic_programming(problem)
    assert problem.arm is not None
    assert isinstance(plan, Plan)
    arm_motion(problem.arm, plan)
    verify(problem, plan)


def compile_rest() -> None:
    """Build a distance field and a map, as small as they can be, and look for a proof that there is no plan."""
    build_field(trimesh.creation.box((100.0, 100.0, 100.0)), 50.0)
    problem = map_problem(load_scan("cylinder"))
    build_maps(replace(problem, T_WS=problem.T_WS[:1]), [_ANY], 2)
    first_unreachable_location(_free_problem(load_scan("cylinder")), 1)


def _free_problem(scan: Scan) -> Problem:
    free = np.full((len(scan.path.T_WS), 36), 0.5)
    return scan_problem(scan, ConfigurationMap(free, metadata={"configuration": _ANY.label}))


if __name__ == "__main__":
    compile_rest()
