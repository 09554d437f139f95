"""Many ticks at machine speed: the functions of `tick`, compiled by numba.

For tuning, Monte Carlo and the verification of plans. The compiled functions are those that the emulator interprets, so
the states are bit-identical; a test checks this. This module needs numpy and numba, the emulator does not.
"""

from functools import cache
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from emulator.firmware import profiler
from emulator.firmware.controller import begin_motion, distance_to
from emulator.firmware.profiler import Profile
from emulator.plant.drive_train import DriveState
from emulator.table.tick import TableConstants, TableState, step
from protocol.program.interrupts import signals_wait

MOVE_TO: Final = 0
MOVE_BY: Final = 1

COLUMNS: Final = (
    "reference_count",
    "reference_speed",  # count/tick, the table's motion bits
    "encoder_count",
    "measured",  # count/window
    "motor_speed_rad_s",
    "motor_angle_rad",
    "table_speed_rad_s",
    "table_angle_rad",
    "current_A",
    "duty",  # PWM steps
    "gain_set",
    "motion",
)

Motions = NDArray[np.int64]
"""(n, 5): tick, MOVE_TO or MOVE_BY, angle, speed, acceleration.

The last three have the table's motion bits, as in the firmware. Rows are in the order of their ticks.
"""

Loads = NDArray[np.float64]
"""(n, 2): tick, and the load torque in Nm from then on. Rows are in the order of their ticks."""

NO_LOADS: Loads = np.empty((0, 2))


def run(
    constants: TableConstants, state: TableState, ticks: int, motions: Motions, loads: Loads = NO_LOADS, every: int = 1
) -> tuple[TableState, NDArray[np.float64]]:
    """Return the state after `ticks`, and a row of `COLUMNS` after every `every` ticks.

    A motion or load that is due at tick k acts before the step from k to k + 1. Signals are deferred to the end of the
    run: an interrupt that is raised in a callback of numba is lost, or crashes the process.
    """
    samples = np.empty((ticks // every, len(COLUMNS)))
    with signals_wait():
        return _compiled()(constants, state, ticks, motions, loads, every, samples), samples


def advance(
    constants: TableConstants,
    state: TableState,
    ticks: int,
    motions: Motions,
    loads: Loads,
    every: int,
    samples: NDArray[np.float64],
) -> TableState:
    """Return the state after `ticks`, filling `samples`: the source of what `run` compiles."""
    next_motion = next_load = 0
    load_torque_Nm = 0.0
    for now in range(ticks):
        while next_load < len(loads) and loads[next_load, 0] <= now:
            load_torque_Nm = loads[next_load, 1]
            next_load += 1
        while next_motion < len(motions) and motions[next_motion, 0] <= now:
            state = _command(state, motions, next_motion, constants.firmware.motion_bits)
            next_motion += 1
        state = step(constants, state, load_torque_Nm)
        if (now + 1) % every == 0:
            _sample(samples, (now + 1) // every - 1, state, constants.firmware.motion_bits)
    return state


def _command(state: TableState, motions: Motions, row: int, bits: int) -> TableState:
    distance = motions[row, 2]
    if motions[row, 1] == MOVE_TO:
        distance = distance_to(state.firmware.reference, distance, bits)
    profile = Profile(motions[row, 3], motions[row, 4], profiler.far_distance(motions[row, 4]))
    return TableState(state.drive, begin_motion(state.firmware, profile, distance, bits), state.duty)


def _sample(samples: NDArray[np.float64], row: int, state: TableState, bits: int) -> None:
    drive: DriveState = state.drive
    controller = state.firmware
    reference = controller.reference
    samples[row, 0] = reference.position_count + reference.fraction / (1 << bits)
    samples[row, 1] = reference.speed
    samples[row, 2] = controller.counts[-1]
    samples[row, 3] = controller.pid.measured
    samples[row, 4] = drive.speed_rad_s
    samples[row, 5] = drive.angle_rad
    samples[row, 6] = drive.table_speed_rad_s
    samples[row, 7] = drive.table_angle_rad
    samples[row, 8] = drive.current_A
    samples[row, 9] = controller.pid.duty
    samples[row, 10] = controller.pid.gain_set
    samples[row, 11] = controller.motion


@cache
def _compiled() -> Any:  # noqa: ANN401  # numba's dispatcher
    from emulator.table.machine_code import compiled, inlined  # noqa: PLC0415  # numba is imported only when it is used

    inlined(_command)
    inlined(_sample)
    return compiled(advance)
