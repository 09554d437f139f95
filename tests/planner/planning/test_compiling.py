import os
import subprocess
import sys
from pathlib import Path

PROGRAM = """
import sys
from numba.core import event
from planner.cell.scan import load_scan
from planner.planning.compiling import compile_default_planner, compile_rest, compiling_beside
from planner.planning.dynamic_programming import dynamic_programming
from planner.planning.scan_planning import plan_scan
from planner.search.unreachability_proof import first_unreachable_location

class Names(event.Listener):
    def on_start(self, compiling):
        names.append(compiling.data["dispatcher"].py_func.__qualname__)
    def on_end(self, _event):
        pass

names = []
event.register("numba:compile", Names())
compile_default_planner()
compile_rest()
assert {"cost_to_go", "_write_distances", "rate_columns", "_first_empty"} <= set(names)
names.clear()
for angles, configuration in ((60, "LEFTY-ABOVE-NOFLIP"), (40, "best")):
    plans = plan_scan(load_scan("mould"), configuration, angles, dynamic_programming, lambda label: None)
    assert plans.best is not None
    first_unreachable_location(plans.best[0], 4)
with compiling_beside("dynamic_programming", lambda label: sys.exit(label)):
    pass  # everything is kept: no process was started
print(*names)
"""


def test_what_was_compiled_for_a_first_plan_is_all_that_another_needs(tmp_path: Path) -> None:
    environment = {**os.environ, "NUMBA_CACHE_DIR": str(tmp_path)}
    run = [sys.executable, "-c", PROGRAM]
    assert subprocess.run(run, env=environment, stdout=subprocess.PIPE, text=True, check=True).stdout.split() == []
