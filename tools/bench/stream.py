"""The accuracy of the streaming of a plan: the stream alone, the shipped scans, and random plans in virtual time."""

import tempfile
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import NamedTuple, TextIO

import numpy as np

from planner.arrays import FloatArray
from planner.defaults import shipped_scans
from planner.execution.execute import Settings
from planner.execution.stream import TimedCommand, reference_states, rounded_stream, stream
from planner.execution.table_motion import TableMotion
from planner.plans.plan import Plan
from planner.table.cost import PathCost
from planner.table.motion import Limits, roll_out
from planner.table.wire import Wire
from protocol.trapezoid import way_to_rest_deg
from tools.bench.timing import print_table
from tools.bench.virtual_run import VirtualRun, random_run_inputs, run_in_virtual_time, shipped_run_input

RANDOM_PLANS = 200
LEAD_S = 0.0035
OFF = (0.8, 1.2)
PLANT = {
    "motor.resistance_ohm": 2.18,
    "motor.torque_constant_Nm_A": 23.4e-3,
    "motor.rotor_inertia_kg_m2": 1.03e-6,
    "gears.efficiency": 0.6,
    "gears.backlash_arcmin": 10.0,
    "table.inertia_kg_m2": 0.3125,
    "table.bearing_friction_Nm": 0.1,
    "friction.coulomb_Nm": 1.15e-3,
}


class StreamFigures(NamedTuple):
    """The deviation of a stream from its plan, by the controller's rules, and the run-on of the table, in deg."""

    at_locations_deg: float
    between_deg: float
    run_on_deg: float


_FINE_S = 0.01
STREAMS: dict[str, Callable[..., Sequence[TimedCommand]]] = {
    "run-on 90 deg": stream,
    "run-on 30 deg": partial(stream, run_on_deg=30.0),
    "each rounded on its own": rounded_stream,
}
# The same figures of a stream that chooses S and A only at the locations, with any run-on. They were measured; the code
# no longer exists.
UNBOUNDED = {
    "cylinder": StreamFigures(0.0182, 0.0188, 147.6),
    "mould": StreamFigures(0.0500, 0.0500, 1110.0),
    "mould-crossed": StreamFigures(0.0500, 0.0532, 920.9),
    "sphere": StreamFigures(0.0080, 0.0117, 217.9),
}
_STREAM_HEADER = ("stream", "at the locations", "between", "run-on")


def bench(stream: TextIO) -> None:
    """Print every figure of streaming and execution."""
    _bench_rounding(stream)
    _bench_shipped(stream)
    _bench_plant(stream)
    _bench_random(stream)


def random_plan(generator: np.random.Generator, step_s: float, duration_s: float, limits: Limits) -> Plan:
    """Return a smooth random motion from rest, within the limits."""
    steps = round(duration_s / step_s)
    accelerations, speed = np.empty(steps), 0.0
    for k in range(steps):
        wanted = 0.2 * limits.acceleration_deg_s2 * generator.standard_normal() - 0.5 * speed
        reach = limits.speed_deg_s - abs(speed) if speed * wanted > 0.0 else limits.speed_deg_s
        accelerations[k] = np.clip(wanted, -reach / step_s, reach / step_s)
        accelerations[k] = np.clip(accelerations[k], -limits.acceleration_deg_s2, limits.acceleration_deg_s2)
        speed += accelerations[k] * step_s
    start = float(np.round(generator.uniform(0.0, 360.0), 1))
    angles, speeds = roll_out(start, 0.0, accelerations, step_s)
    return Plan("random", "", step_s, angles, speeds, accelerations, PathCost(0.0, 0.0, 0.0))


def stream_figures(motion: TableMotion, commands: Sequence[TimedCommand]) -> StreamFigures:
    """Return the maximum deviations of a stream, from the first location to the last, and its maximum run-on."""

    def worst(times_s: FloatArray) -> float:
        angles_deg = np.array([state.angle_deg for state in reference_states(commands, times_s)])
        return float(np.abs(angles_deg - motion.angles_at(times_s)).max())

    run_ons_deg = []
    for each in commands:
        lowest_deg, highest_deg = way_to_rest_deg(each.expected, each.command)
        run_ons_deg += [highest_deg - each.expected.angle_deg, each.expected.angle_deg - lowest_deg]
    between_s = np.arange(0.0, float(motion.column_times_s[-1]), _FINE_S)
    return StreamFigures(worst(motion.column_times_s), worst(between_s), max(run_ons_deg))


def _bench_rounding(out: TextIO) -> None:
    limits, rows = Limits(), []
    for step_s in (0.1, 0.5, 1.0):
        generator = np.random.default_rng(0)
        motions = [TableMotion(random_plan(generator, step_s, 60.0, limits), limits) for _ in range(20)]
        rows += [_figures_of(f"{step_s:g} s, {name}", motions, limits, streamed) for name, streamed in STREAMS.items()]
    print_table(out, "20 random minutes, one decimal: maximum deviation and run-on, in deg", _STREAM_HEADER, rows)
    rows = []
    for scan in shipped_scans():
        run_input = shipped_run_input(scan)
        motion, limits = run_input.motion(), run_input.problem.limits
        rows += [_figures_of(f"{scan}, {name}", [motion], limits, streamed) for name, streamed in STREAMS.items()]
        rows.append((f"{scan}, run-on not bounded, S and A only", *(f"{value:g}" for value in UNBOUNDED[scan])))
    print_table(out, "The same for the shipped scans", _STREAM_HEADER, rows)


def _figures_of(
    name: str, motions: Sequence[TableMotion], limits: Limits, streamed: Callable[..., Sequence[TimedCommand]]
) -> tuple[str, ...]:
    figures = [stream_figures(motion, streamed(motion, limits, Wire())) for motion in motions]
    at_locations_deg, between_deg, run_on_deg = (max(column) for column in zip(*figures, strict=True))
    return name, f"{at_locations_deg:.4f}", f"{between_deg:.4f}", f"{run_on_deg:.1f}"


def _bench_shipped(out: TextIO) -> None:
    rows = []
    for name in shipped_scans():
        run_input = shipped_run_input(name)
        for lead_s in (0.0, LEAD_S):
            run = run_in_virtual_time(run_input, settings=Settings(lead_s=lead_s))
            rows.append((f"{name}, sent {1000.0 * lead_s:g} ms ahead", *_figures(run)))
    print_table(out, "Shipped scans in virtual time, worst deg at the locations", ("scan", *_HEADER), rows)


def _bench_plant(out: TextIO) -> None:
    run_input = shipped_run_input("cylinder")
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        for name, value in PLANT.items():
            for factor in OFF:
                section, key = name.split(".")
                config = Path(folder) / "plant.toml"
                config.write_text(f"[{section}]\n{key} = {factor * value!r}\n", encoding="utf-8")
                for lead_s in (0.0, LEAD_S):
                    run = run_in_virtual_time(run_input, f"emulator://?config={config}", Settings(lead_s=lead_s))
                    rows.append((f"{name} x {factor:g}, {1000.0 * lead_s:g} ms ahead", *_figures(run)))
    print_table(out, "Cylinder scan with other plants", ("plant", *_HEADER), rows)


_HEADER = ("reference, as sent", "encoder", "true", "cells", "late ms", "over real time")


def _figures(run: VirtualRun) -> tuple[str, ...]:
    checked = run.checked
    return (
        *(f"{checked.deviations[name].at_locations_deg:.4f}" for name in ("reference", "encoder", "true")),
        str(len(checked.forbidden_steps)),
        f"{1000.0 * checked.latest_command_s:.1f}",
        f"{run.simulated_s / run.real_s:.0f} x",
    )


def _bench_random(out: TextIO) -> None:
    rows = []
    for name, margin, lead_s in (
        ("planned one sample clear", 1, 0.0),
        ("planned one sample clear, 3.5 ms ahead", 1, LEAD_S),
        ("planned up to the cells", 0, LEAD_S),
    ):
        runs = [
            run_in_virtual_time(each, settings=Settings(lead_s=lead_s))
            for each in random_run_inputs(RANDOM_PLANS, margin)
        ]
        worst = [
            max(run.checked.deviations[name].at_locations_deg for run in runs) for name in ("reference", "encoder")
        ]
        touched = sum(bool(run.checked.forbidden_steps) for run in runs)
        stopped = sum(run.checked.failure is not None for run in runs)
        late_ms = 1000.0 * max(run.checked.latest_command_s for run in runs)
        speed = sum(run.simulated_s for run in runs) / sum(run.real_s for run in runs)
        rows.append(
            (name, *(f"{each:.4f}" for each in worst), str(touched), str(stopped), f"{late_ms:.1f}", f"{speed:.0f} x")
        )
    header = ("plans", "reference, as sent", "encoder", "touched a cell", "stopped", "late ms", "over real time")
    print_table(out, f"{RANDOM_PLANS} random plans of 10 s at 0.1 s steps, virtual time", header, rows)
