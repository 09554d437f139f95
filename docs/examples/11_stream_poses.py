"""A program that sends scan locations one after another to a table that moves, as an adaptive scan would find them."""

import json
import subprocess
import sys

import planner

scan = planner.load_scan("cylinder")
options = "--angles 90 --configuration LEFTY-ABOVE-NOFLIP --view 10 --port emulator:// --arm-away --out track"
command = [sys.executable, "-m", "planner", "track", "cylinder", "--poses", "-", *options.split()]
with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as tracker:  # noqa: S603  # our own
    assert tracker.stdin is not None
    for T_WS in scan.path.T_WS[:30]:  # a program of your own computes the next location from what it measured
        tracker.stdin.write(json.dumps(T_WS.tolist()) + "\n")
        tracker.stdin.flush()  # waits while the window is full
    tracker.stdin.write('"end"\n')
    shown, _ = tracker.communicate()
print(shown)
