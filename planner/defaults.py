"""Names that a user can choose, and default values; this module loads none of the code behind them."""

from collections.abc import Mapping
from pathlib import Path
from types import MappingProxyType

SCANS = Path(__file__).with_name("scans")
"""The folder of the shipped scans."""

DYNAMIC_PROGRAMMING = "dynamic_programming"
RECEDING = "receding"
GUIDED_RAY_SHOOTING = "guided_ray_shooting"
RAY_SHOOTING = "ray_shooting"
ROTATE_WHEN_BLOCKED = "rotate_when_blocked"
DIJKSTRA = "dijkstra"
LOCAL_MAXIMA = "local_maxima"
PLANNER_NAMES = (
    DYNAMIC_PROGRAMMING,
    RECEDING,
    GUIDED_RAY_SHOOTING,
    RAY_SHOOTING,
    ROTATE_WHEN_BLOCKED,
    DIJKSTRA,
    LOCAL_MAXIMA,
)
DEFAULT_PLANNER = DYNAMIC_PROGRAMMING

DEFAULT_ANGLES = 360
"""Number of table angles of a map over one turn."""

PART_CLASSES = ("block", "cylinder", "mould", "sphere")
PATTERN_NAMES = ("crossed", "helix", "meridians", "raster", "rings", "spiral", "tilted")
AXES = ("x", "-x", "y", "-y", "z", "-z")
"""Axes of a mesh file that may point up."""

MILLIMETERS: Mapping[str, float] = MappingProxyType({"mm": 1.0, "cm": 10.0, "m": 1000.0, "inch": 25.4})
"""The units of length of a mesh file, in mm."""

LAG_S = 0.0035
"""Lag of the encoder behind the reference: the lag of the emulator's speed loop."""
LEAD_S = 0.0
TOLERANCE_DEG = 0.25
"""Allowed deviation of the encoder at a location."""
RUN_ON_DEG = 90.0
"""Maximum angle that the table runs on if the line fails."""
PROFILES_HZ = 25.0
SHARE_SEEN = 0.99
"""Share of what can be seen that an adaptive scan sees."""
MOST_STRIPS = 200
"""How many strips an adaptive scan has at most."""

REPORT_FILE = "report.html"
"""The name of the page in a folder of results."""


def shipped_scans() -> list[str]:
    """Return the names of the shipped scans."""
    return sorted(file.stem for file in SCANS.glob("*.toml"))
