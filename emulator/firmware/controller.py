"""One tick of the controller: profiler, speed estimate, PID, and motor protection.

A motion has these states:

    IDLE     the drive is off; friction holds the table
    MOVING   the profile runs, the PID follows its speed
    SETTLING the profile has ended; the table creeps until the encoder has stayed at the target for a while, then IDLE
    STALLED  the motor was driven but the encoder stood still: the drive is off until the next motion
"""

from typing import NamedTuple

from emulator.firmware.fixed_point import ERROR_BITS, clamp
from emulator.firmware.pid import HOLD, RAMP, Pid, PidState, switched_off
from emulator.firmware.pid import step as pid_step
from emulator.firmware.profiler import Profile, Reference, at_rest, retarget, standing_at
from emulator.firmware.profiler import step as profiler_step
from emulator.int32 import wrap_int32

IDLE = 0
MOVING = 1
SETTLING = 2
STALLED = 3
DRIVE_OFF = (IDLE, STALLED)

STATE_NAMES = ("idle", "moving", "settling", "stalled")


class Firmware(NamedTuple):
    """The controller's constants, in its own number formats."""

    pid: Pid
    motion_bits: int  # fraction bits of position, speed and acceleration
    window_ticks: int  # interval of the speed measurement
    arrival_count: int  # within this distance the table is at the target
    arrival_ticks: int  # time at the target until the motion ends
    approach_rate: int  # of speed over remaining distance, per tick; `motion_bits`
    approach_speed: int  # count/tick, `motion_bits`
    stall_duty: int  # PWM steps; above this duty a healthy motor turns
    stall_ticks: int  # maximum time without motion
    settling_ticks: int  # maximum settling time


class FirmwareState(NamedTuple):
    """The controller's state."""

    motion: int  # IDLE, MOVING, SETTLING or STALLED
    profile: Profile
    reference: Reference
    counts: tuple[int, ...]  # of the last ticks, oldest first; the length is the speed window
    pid: PidState
    still_ticks: int  # ticks at high duty without a change of the count
    settling_ticks: int  # ticks since the end of the profile
    arrived_ticks: int  # ticks within the arrival window without a break


def power_on(parameters: Firmware, profile: Profile, count: int) -> FirmwareState:
    """Return the controller at power-on: at rest at the encoder's position."""
    return FirmwareState(
        motion=IDLE,
        profile=profile,
        reference=standing_at(count),
        counts=(count,) * parameters.window_ticks,
        pid=PidState(0, 0, HOLD, 0),
        still_ticks=0,
        settling_ticks=0,
        arrived_ticks=0,
    )


def begin_motion(state: FirmwareState, profile: Profile, distance: int, bits: int) -> FirmwareState:
    """Return the controller with a new target, `distance` (`bits` fraction bits) from the reference.

    The reference continues from its present position and speed. For a stalled table, it starts at the present count.
    """
    return FirmwareState(MOVING, profile, retarget(state.reference, distance, bits), state.counts, state.pid, 0, 0, 0)


def distance_to(reference: Reference, target: int, bits: int) -> int:
    """Return the distance to an absolute position; both with `bits` fraction bits, neither modulo a turn."""
    return target - (reference.position_count << bits) - reference.fraction


def step(parameters: Firmware, state: FirmwareState, count: int) -> FirmwareState:
    """Return the controller after one tick, at the end of which the encoder's counter reads `count`."""
    motion, profile, reference, counts, regulator, still_ticks, settling_ticks, arrived_ticks = state
    measured = wrap_int32(count - counts[0])
    last_count, bits = counts[-1], parameters.motion_bits
    counts = (*counts[1:], count)
    if motion in DRIVE_OFF:
        return _drive_off(motion, profile, reference, counts, switched_off(regulator, measured))

    if motion == MOVING:
        last_speed = reference.speed
        reference = profiler_step(profile, reference, bits)
        demand = reference.speed
        gain_set = HOLD if reference.speed == last_speed else RAMP
        if at_rest(reference):
            motion = SETTLING
    else:
        remaining = position_error(reference, count, bits)
        arrived_ticks = arrived_ticks + 1 if abs(remaining) <= parameters.arrival_count else 0
        if arrived_ticks >= parameters.arrival_ticks:
            return _drive_off(IDLE, profile, reference, counts, switched_off(regulator, measured))
        demand = 0 if arrived_ticks else clamp(remaining * parameters.approach_rate, parameters.approach_speed)
        gain_set = HOLD
        settling_ticks += 1

    window_demand = (demand * parameters.window_ticks) >> (bits - ERROR_BITS)
    regulator = pid_step(parameters.pid, regulator, gain_set, window_demand, measured)
    still = count == last_count and abs(regulator.duty) >= parameters.stall_duty
    still_ticks = still_ticks + 1 if still else 0
    if still_ticks >= parameters.stall_ticks or settling_ticks >= parameters.settling_ticks:
        return _drive_off(STALLED, profile, standing_at(count), counts, switched_off(regulator, measured))
    return FirmwareState(motion, profile, reference, counts, regulator, still_ticks, settling_ticks, arrived_ticks)


def _drive_off(
    motion: int, profile: Profile, reference: Reference, counts: tuple[int, ...], regulator: PidState
) -> FirmwareState:
    return FirmwareState(motion, profile, reference, counts, regulator, 0, 0, 0)


def position_error(reference: Reference, count: int, bits: int) -> int:
    """Return the distance of the encoder from the reference position, in whole counts."""
    return wrap_int32(reference.position_count + (reference.fraction >> (bits - 1)) - count)
