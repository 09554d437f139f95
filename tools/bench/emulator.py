"""The speed of the emulator, compared with references that run in the same minute on the same machine."""

import os
import resource
import select
import signal
import subprocess
import sys
import threading
import time
import tty
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TextIO

import control
import numpy as np

from emulator.config.table_config import TableConfig, load_config
from emulator.protocol_emulator import RUN, Serial
from emulator.table import batch
from emulator.table.interpreter import Interpreter
from emulator.table.table import Table
from emulator.table.tick import TableConstants, TableState
from protocol.program.own_program import own_environment, own_program
from tools.bench.timing import median_s, percentile, print_table
from tools.bench.virtual_run import random_run_inputs, run_in_virtual_time

EXCHANGES = 2000


def bench(stream: TextIO) -> None:
    """Print every figure of the emulator."""
    _bench_simulation(stream)
    _bench_growth(stream)
    _bench_virtual_time(stream)
    _bench_round_trip(stream)
    _bench_start(stream)
    _bench_idle(stream)


def _bench_simulation(stream: TextIO) -> None:
    """Print the speeds of a running emulator; `_bench_growth` measures the start."""
    config = load_config()
    runs = {
        "emulator, compiled (full physics)": (1000.0, _compiled_motion),
        "emulator, interpreted (full physics)": (10.0, _interpreted_motion),
        "python-control, linear loop": (100.0, _linear_loop),
    }
    speeds = {name: simulated_s / median_s(run(config, simulated_s)) for name, (simulated_s, run) in runs.items()}
    peer = speeds["python-control, linear loop"]
    rows = [(name, f"{speed:,.0f} x", f"{speed / peer:,.1f}") for name, speed in speeds.items()]
    header = ("one long motion, ticks of 1 ms, one core", "real time", "over the peer")
    print_table(stream, "Simulation", header, rows)


def _bench_growth(stream: TextIO) -> None:
    config = load_config()
    rows = []
    for simulated_s in (10.0, 100.0, 1000.0, 10_000.0):
        wall_s = median_s(lambda duration=simulated_s: _compiled_motion(config, duration)(), runs=3)  # type: ignore[misc]  # a default argument
        rows.append((f"compiled, {simulated_s:,.0f} s in motion", f"{wall_s / simulated_s * 1e6:.2f}", _peak_memory()))
    for name, angle_deg, motions, simulated_s in (
        ("interpreted, 10 s in motion", 100_000.0, 1, 10.0),
        ("interpreted, 100 s in motion", 100_000.0, 1, 100.0),
        ("interpreted, 1,000 s in motion", 100_000.0, 1, 1000.0),
        ("interpreted, a day with 24 motions", 90.0, 24, 86_400.0),
        ("interpreted, a week with 168 motions", 90.0, 168, 7 * 86_400.0),
    ):
        command = own_program("tools.bench.interpreted_run", str(angle_deg), str(motions), str(simulated_s))
        answer = subprocess.run(command, check=True, capture_output=True, text=True, env=own_environment())
        wall_s, peak_mb = (float(number) for number in answer.stdout.split())
        rows.append((name, f"{wall_s / simulated_s * 1e6:.2f}", f"{peak_mb:.0f} MB"))
    header = ("simulated time (interpreted: alone in its process)", "us of work per s", "peak memory")
    print_table(stream, "Growth", header, rows)


def _bench_virtual_time(stream: TextIO) -> None:
    """Print the waiting times of clients of `emulator://`, interpreted as without numba, and compiled."""
    plans = list(random_run_inputs(3, margin=3))
    rows = []
    for name, warm_up_ticks in (("interpreted", 10**15), ("compiled", 0)):
        RUN.warm_up_ticks = warm_up_ticks
        wait_s = median_s(_minute_of_motion())
        speeds = sorted(run.simulated_s / run.real_s for run in map(run_in_virtual_time, [plans[0], *plans]))
        rows.append((name, f"{wait_s * 1e3:.1f} ms", f"{speeds[0]:.0f} to {speeds[-1]:.0f} x"))
    header = ("emulator://", "a minute of motion, then H", "a streamed plan, over real time")
    print_table(stream, "Virtual time", header, rows)


def _minute_of_motion() -> Callable[[], object]:
    port = Serial("emulator://?baud=0", timeout=1.0)
    port.write(b"S 40\rR 1000000\r")
    port.read_until(b"\r")

    def wait() -> None:
        port.clock.sleep_s(60.0)
        port.write(b"H\r")
        port.read(port.in_waiting)

    return wait


def _bench_round_trip(stream: TextIO) -> None:
    with _raw_echo() as (path, _):
        echo = _round_trips(path)
    with _emulator("--pty", "--baud", "0") as (path, _):
        ours = _round_trips(path)
    rows = [
        (name, f"{percentile(times, 0.5) * 1e3:.3f} ms", f"{percentile(times, 0.99) * 1e3:.3f} ms")
        for name, times in (("raw pty echo, in one process", echo), ("H, emulator in its own process", ours))
    ]
    ratios = [f"{percentile(ours, share) / percentile(echo, share):.1f}" for share in (0.5, 0.99)]
    rows.append(("ratio", ratios[0], ratios[1]))
    print_table(stream, "Command round trip, pacing off", ("exchange", "p50", "p99"), rows)


def _bench_start(stream: TextIO) -> None:
    def ready(command: list[str]) -> Callable[[], None]:
        def run() -> None:
            with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL) as process:
                assert process.stdout is not None
                process.stdout.readline()
                process.send_signal(signal.SIGTERM)

        return run

    ours = median_s(ready(own_program("emulator", "--pty")))
    bare = median_s(ready([sys.executable, "-c", "print(flush=True); import time; time.sleep(9)"]))
    rows = [("python, first line", f"{bare:.3f} s"), ("python -m emulator --pty, first line", f"{ours:.3f} s")]
    print_table(stream, "Start to ready", ("program", "median"), rows)


def _bench_idle(stream: TextIO) -> None:
    with _emulator("--pty") as (_, process):
        time.sleep(0.5)
        before, start = _cpu_s(process.pid), time.perf_counter()
        time.sleep(4.0)
        share = (_cpu_s(process.pid) - before) / (time.perf_counter() - start)
    print_table(
        stream, "Idle in real time", ("program", "share of a core"), [("emulator, table at rest", f"{share:.1%}")]
    )


def _long_motion(config: TableConfig) -> tuple[TableConstants, TableState, batch.Motions]:
    table = Table(config)
    registers = Interpreter(config).power_on()
    snapshot = table.snapshot()
    far = 2**31 - 1 << 26
    motions = np.array([[0, batch.MOVE_BY, far, registers.speed, registers.acceleration]], dtype=np.int64)
    return snapshot.constants, snapshot.state, motions


def _compiled_motion(config: TableConfig, simulated_s: float) -> Callable[[], object]:
    constants, state, motions = _long_motion(config)
    ticks = round(simulated_s * config.control.tick_hz)
    return lambda: batch.run(constants, state, ticks, motions, every=ticks)


def _interpreted_motion(config: TableConfig, simulated_s: float) -> Callable[[], object]:
    """Return a run that continues the previous one."""
    table = Table(config.with_serial(baud=0))
    table.receive(b"R 100000\r")
    ticks = round(simulated_s * config.control.tick_hz)
    return lambda: table.advance(ticks)


def _linear_loop(config: TableConfig, simulated_s: float) -> Callable[[], object]:
    """Return the reference: motor and PI in python-control, without friction, gears, quantization or protocol."""
    motor, tick_s = config.motor, 1.0 / config.control.tick_hz
    inertia = motor.rotor_inertia_kg_m2 + config.gears.inertia_kg_m2
    plant = control.ss(
        [
            [-motor.resistance_ohm / motor.inductance_H, -motor.torque_constant_Nm_A / motor.inductance_H],
            [motor.torque_constant_Nm_A / inertia, 0.0],
        ],
        [[config.driver.supply_V / motor.inductance_H], [0.0]],
        [[0.0, np.degrees(1.0) / config.gears.ratio]],
        0.0,
    )
    gains = config.gains.hold
    gain, integral_s = gains.proportional_duty_s_deg, gains.integral_time_s
    regulator = control.tf([gain * (1 + tick_s / integral_s), -gain], [1, -1], tick_s)
    loop = control.ss(control.feedback(control.sample_system(plant, tick_s) * control.ss(regulator)))
    times = np.arange(round(simulated_s / tick_s)) * tick_s
    demand = np.minimum(20.0 * times, 10.0)
    return lambda: control.forced_response(loop, times, demand)


def _round_trips(path: str) -> list[float]:
    port = os.open(path, os.O_RDWR | os.O_NOCTTY)
    try:
        durations = []
        for _ in range(EXCHANGES):
            start = time.perf_counter()
            os.write(port, b"H\r")
            reply = b""
            while not reply.endswith(b"\r"):
                reply += os.read(port, 64)
            durations.append(time.perf_counter() - start)
        return durations
    finally:
        os.close(port)


@contextmanager
def _raw_echo() -> Iterator[tuple[str, None]]:
    master, slave = os.openpty()
    tty.setraw(slave)
    stop_read, stop_write = os.pipe()

    def echo() -> None:
        while True:
            ready, _, _ = select.select([master, stop_read], [], [])
            if stop_read in ready:
                return
            os.write(master, os.read(master, 64))

    thread = threading.Thread(target=echo)
    thread.start()
    try:
        yield os.ttyname(slave), None
    finally:
        os.write(stop_write, b"x")
        thread.join()
        for descriptor in (master, slave, stop_read, stop_write):
            os.close(descriptor)


@contextmanager
def _emulator(*arguments: str) -> Iterator[tuple[str, "subprocess.Popen[str]"]]:
    command = own_program("emulator", *arguments)
    with subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True, env=own_environment()
    ) as process:
        assert process.stdout is not None
        try:
            yield process.stdout.readline().strip(), process
        finally:
            process.terminate()


def _cpu_s(pid: int) -> float:
    user, system = Path(f"/proc/{pid}/stat").read_text(encoding="ascii").rsplit(")", 1)[1].split()[11:13]
    return (int(user) + int(system)) / os.sysconf("SC_CLK_TCK")


def _peak_memory() -> str:
    return f"{resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024:.0f} MB"
