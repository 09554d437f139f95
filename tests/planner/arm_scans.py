"""Scans whose probe rolls about its beam, so that the arm cannot follow the cheapest motion on the map."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

# The arm looks down on a cylinder, a little beside the axis of the table: only the probe's roll changes.
_SCAN = """
[cell]
arm = "viper_s650"
table_in_base = [450, 0, 0, 0, 0, 0]
probe_on_flange = [0, 0, 100, 0, 0, 0]

[workpiece]
class = "cylinder"
diameter_mm = 140
height_mm = 100

[path]
file = "{path}"
time_step_s = {step_s}
"""


def write_rolling_scan(folder: Path, name: str, rolls_deg: Sequence[float], step_s: float) -> Path:
    """Write a scan whose probe rolls by so many degrees from each location to the next, and return its file."""
    yaws_deg = np.concatenate(([0.0], np.cumsum(rolls_deg)))
    lines = ["x,y,z,yaw,pitch,roll", *(f"60,0,250,{yaw:.12g},180,0" for yaw in yaws_deg)]
    (folder / f"{name}.csv").write_text("\n".join(lines) + "\n", encoding="utf-8")
    scan = folder / f"{name}.toml"
    scan.write_text(_SCAN.format(path=f"{name}.csv", step_s=step_s), encoding="utf-8")
    return scan


def winding_scan(folder: Path) -> Path:
    """Joint 6 winds up: the probe rotates by 1200 deg, joint 6 can rotate by 720.

    The table has to take over the rest.
    """
    return write_rolling_scan(folder, "winding", [30.0] * 40, step_s=1.0)


def hasty_scan(folder: Path) -> Path:
    """Joint 6 is too fast: 630 deg/s back and forth, of 600. The table has to take over 30 deg/s."""
    rolls = [0.0] * 8 + [63.0] * 10 + [0.0] * 10 + [-63.0] * 10
    return write_rolling_scan(folder, "hasty", rolls, step_s=0.1)


def hopeless_scan(folder: Path) -> Path:
    """No plan: of 76 deg per location the table takes over 40, and joint 6 has two turns for the rest."""
    return write_rolling_scan(folder, "hopeless", [76.0] * 22, step_s=1.0)
