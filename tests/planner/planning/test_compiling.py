import os
import subprocess
import sys
from pathlib import Path

PROGRAM = """
import sys
from numba.core import event
from planner.cell.scan import load_scan
from planner.map.synthetic_maps import MapFamily, synthetic_map
from planner.kinematics.configuration import Configuration
from planner.map.config_map import ConfigurationMap
from planner.planning.compiling import compile_default_planner, compiling_beside
from planner.planning.dynamic_programming import dynamic_programming
from planner.plans.plan import Plan
from planner.planning.scan_problem import scan_problem
from planner.plans.arm_motion import arm_motion
from planner.plans.verification import verify

class Names(event.Listener):
    def on_start(self, compiling):
        names.append(compiling.data["dispatcher"].py_func.__qualname__)
    def on_end(self, _event):
        pass

names = []
event.register("numba:compile", Names())
compile_default_planner()
assert "cost_to_go" in names
names.clear()
scan = load_scan("mould")
values = synthetic_map(MapFamily(location_count=len(scan.path.T_WS), angle_count=90, forbidden=0.1), 3).values
problem = scan_problem(scan, ConfigurationMap(values, metadata={"configuration": "LEFTY-ABOVE-NOFLIP"}))
plan = dynamic_programming(problem)
assert isinstance(plan, Plan), plan
arm_motion(problem.arm, plan)
verify(problem, plan)
with compiling_beside("dynamic_programming", lambda label: sys.exit(label)) as wait:
    wait()  # everything is kept: no process was started
print(*names)
"""


def test_what_was_compiled_beside_the_map_is_all_that_another_plan_needs(tmp_path: Path) -> None:
    environment = {**os.environ, "NUMBA_CACHE_DIR": str(tmp_path)}
    run = [sys.executable, "-c", PROGRAM]
    assert subprocess.run(run, env=environment, stdout=subprocess.PIPE, text=True, check=True).stdout.split() == []
