"""The main job, on real input: `python -m tools.demo --out DIR`.

Starts the stand-in as a program of its own, opens the port that it prints with pyserial, drives a motion that new
commands pre-empt again and again (Fig. 4 of the paper), and draws what the table did.
"""

import argparse
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from emulator.trace import read_trace
from protocol import TableClient, TableError
from tools.plot_trace import draw_trace, save_figure

STEPS = (  # after how many seconds, top speed deg/s, acceleration deg/s2, target deg
    (0.0, 20.0, 20.0, 60.0),
    (1.8, 35.0, 40.0, 120.0),  # faster, in full motion
    (0.9, 10.0, 40.0, 120.0),  # slower: it brakes at A, no step
    (1.4, 30.0, 30.0, 20.0),  # behind: it brakes, turns and comes back
    (1.6, 15.0, 60.0, 45.0),  # behind again
)
END_DEG = STEPS[-1][-1]


def main(arguments: list[str] | None = None) -> int:
    """Run the demonstration and return the exit status."""
    parser = argparse.ArgumentParser(
        prog="python -m tools.demo",
        description="Drive the stand-in over a pseudo-terminal and draw what it did.",
        epilog="example: python -m tools.demo --out build/demo",
    )
    parser.add_argument("--out", metavar="DIR", type=Path, required=True, help="where trace and picture go")
    out = parser.parse_args(arguments).out
    try:
        out.mkdir(parents=True, exist_ok=True)
        with _stand_in(out / "trace.csv") as port, TableClient.open(port) as table:
            _drive(table)
        trace = read_trace(out / "trace.csv")
        figure = draw_trace(trace, "A motion pre-empted in full run: the reference's speed never jumps")
        save_figure(figure, out / "preemption.png")
    except (OSError, TableError) as error:
        print(f"demo: {error}", file=sys.stderr)
        return 2
    print(out / "preemption.png")
    return 0


def _drive(table: TableClient) -> None:
    for wait_s, speed_deg_s, acceleration_deg_s2, target_deg in STEPS:
        table.clock.sleep_s(wait_s)
        table.set_speed(speed_deg_s)
        table.set_acceleration(acceleration_deg_s2)
        table.move_to(target_deg)
        _say(f"at {table.position_deg():6.1f} deg: S {speed_deg_s}, A {acceleration_deg_s2}, P {target_deg}")
    reached_deg = table.wait_until_at(END_DEG)
    _say(f"at {reached_deg:6.1f} deg: arrived")


@contextmanager
def _stand_in(trace: Path) -> Iterator[str]:
    """Run the stand-in on a pty and yield the pty's name; the trace is complete afterwards."""
    command = [sys.executable, "-m", "emulator", "--pty", "--trace", str(trace)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        try:
            yield process.stdout.readline().strip()
        finally:
            process.terminate()


def _say(sentence: str) -> None:
    print(f"demo: {sentence}", file=sys.stderr, flush=True)


if __name__ == "__main__":
    sys.exit(main())
