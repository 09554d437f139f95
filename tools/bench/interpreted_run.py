"""A run of the table alone in its process, without numpy and numba, as in the emulator.

python -m tools.bench.interpreted_run 90 24 86400     24 motions by 90 degrees in a day; prints wall seconds and peak MB
"""

import sys
import time
from pathlib import Path

from emulator.config.table_config import load_config
from emulator.table.table import Table


def interpreted_run(angle_deg: float, motions: int, simulated_s: float) -> tuple[float, float]:
    """Return the wall time in seconds of motions evenly spread over a simulated time, and this process's peak in MB."""
    config = load_config()
    table, start = Table(config), time.perf_counter()
    for _ in range(motions):
        table.receive(b"R %.1f\r" % angle_deg)
        table.advance(round(simulated_s / motions * config.control.tick_hz))
    return time.perf_counter() - start, _peak_memory_mb()


def _peak_memory_mb() -> float:
    """Return this program's peak memory (Linux); the value from `resource` includes the parent's."""
    status = Path("/proc/self/status").read_text(encoding="ascii")
    return int(status.partition("VmHWM:")[2].split()[0]) / 1024


if __name__ == "__main__":
    print(*interpreted_run(float(sys.argv[1]), int(sys.argv[2]), float(sys.argv[3])))
