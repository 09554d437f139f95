"""From a scan to a verified run in three calls; every result is a typed value."""

import sys

import planner

scan = planner.load_scan("cylinder")  # a scan file, or a shipped scan
planned = planner.plan(scan, configuration="LEFTY-ABOVE-NOFLIP", angle_count=90)
if isinstance(planned, planner.NoPlan):
    sys.exit(planned.reason)
print(f"cost {planned.plan.cost.total:.2f}, executable: {planned.is_executable}")
print(f"{planned.verification.clearance_deg:.1f} deg to the nearest forbidden table angle")

options = planner.RunOptions(port="emulator://", arm_is_away=True)
finished = planner.run(planned, "emulator://", out="run", options=options)
print(finished.checked.verdict)
