import subprocess
import sys

PROGRAM = """
import gc
import sys
from planner.cell.scan import load_scan
from planner.kernel import _Kernel
from planner.planning.compiling import compile_default_planner, compile_rest, compiling_beside
from planner.planning.dynamic_programming import dynamic_programming
from planner.planning.scan_planning import plan_scan
from planner.search.unreachability_proof import first_unreachable_location

def compiled():
    kernels = [each for each in gc.get_objects() if isinstance(each, _Kernel) and "_compiled" in vars(each)]
    return {(each.__qualname__, str(types)) for each in kernels for types in each._compiled.signatures}

compile_default_planner()
compile_rest()
before = compiled()
assert {"cost_to_go", "_write_distances", "rate_columns", "_first_empty"} <= {name for name, _types in before}
for angles, configuration in ((60, "LEFTY-ABOVE-NOFLIP"), (40, "best")):
    plans = plan_scan(load_scan("mould"), configuration, angles, dynamic_programming, lambda label: None)
    assert plans.best is not None
    first_unreachable_location(plans.best.problem, 4)
with compiling_beside("dynamic_programming", lambda label: sys.exit(label)):
    pass  # everything is kept: no process was started
seldom = {"turns_the_long_way"}  # small, and only some motions call it
print(*[name for name, _types in compiled() - before if name not in seldom])
"""


def test_what_is_compiled_for_a_first_plan_is_all_that_another_needs() -> None:
    run = [sys.executable, "-c", PROGRAM]
    assert subprocess.run(run, stdout=subprocess.PIPE, text=True, check=True).stdout.split() == []
