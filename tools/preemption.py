"""Draw a motion that new commands pre-empt repeatedly (Fig. 4 of the paper), on a real pty.

Starts the emulator as a separate program and opens the port that it prints with pyserial.
"""

import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from emulator.trace import read_trace
from planner.plot_style import save_picture
from protocol import TableClient
from protocol.program.own_program import own_environment, own_program
from tools.trace_figure import draw_trace

STEPS = (  # time in seconds, maximum speed deg/s, acceleration deg/s2, target deg
    (0.0, 20.0, 20.0, 60.0),
    (1.8, 35.0, 40.0, 120.0),  # faster, at full speed
    (0.9, 10.0, 40.0, 120.0),  # slower: it brakes at A, no step
    (1.4, 30.0, 30.0, 20.0),  # behind: it brakes, reverses and returns
    (1.6, 15.0, 60.0, 45.0),  # behind again
)
END_DEG = STEPS[-1][-1]


def draw_preemption(out: Path) -> Path:
    """Run the motion over a pty, and return the picture of the table's motion; trace and picture go to `out`.

    Raises:
        OSError: the emulator cannot be started, or a file cannot be written.
        TableError: the table failed.
    """
    with start_emulator("--pty", "--trace", str(out / "trace.csv")) as port, TableClient.open(port) as table:
        _drive(table)
    figure = draw_trace(
        read_trace(out / "trace.csv"), "Fig. 4: a motion pre-empted at full speed; the reference speed has no steps"
    )
    picture = out / "preemption.png"
    save_picture(figure, picture)
    return picture


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
def start_emulator(*arguments: str) -> Iterator[str]:
    """Run the emulator as a separate program and yield its port's name; its recording is complete afterwards.

    Ctrl-C at the terminal does not reach the emulator: it must still run when the table is stopped.
    """
    command = own_program("emulator", *arguments)
    with subprocess.Popen(
        command, stdout=subprocess.PIPE, text=True, start_new_session=True, env=own_environment()
    ) as process:
        assert process.stdout is not None
        try:
            yield process.stdout.readline().strip()
        finally:
            process.terminate()


def _say(sentence: str) -> None:
    print(f"demo: {sentence}", file=sys.stderr, flush=True)
