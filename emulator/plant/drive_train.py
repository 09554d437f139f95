"""Motor, gears with backlash, and table: the plant from the PWM voltage to the true angle of the table.

The teeth of the chain may be in contact, on the flank that drives the table forward (`contact` = 1) or backward (-1).
Then motor and table turn as one. Otherwise (0) the motor runs free within the backlash, and the table coasts. Each tick
is computed in one of these states. Contact ends when the table would have to pull on the flank. When the gap closes,
the two bodies continue with a common speed, without rebound.

The gears' efficiency acts on the torque through the teeth. A driven table loads the motor with 1/efficiency of its
torque. A driving table loads it with the efficiency times its torque.
"""

import math
from typing import NamedTuple

from emulator.plant.friction import Friction, sliding_torque_Nm
from emulator.plant.motor import Motor, MotorStep, discretize


class Gears(NamedTuple):
    """The gears between motor and table."""

    ratio: float
    efficiency: float
    inertia_kg_m2: float  # at the motor
    backlash_arcmin: float  # at the table


class Coupling(NamedTuple):
    """Motor and table in contact, for one direction of the power flow through the teeth."""

    motor: MotorStep
    torque_ratio: float  # torque at the motor for a torque at the table
    inertia_kg_m2: float  # of the table, at the motor


class DriveTrain(NamedTuple):
    """The constants of the plant, per tick."""

    free: MotorStep
    driving: Coupling
    overhauling: Coupling
    friction: Friction
    torque_constant_Nm_A: float
    resistance_ohm: float
    current_decay: float  # of a motor at rest, per tick
    motor_inertia_kg_m2: float  # with the gears
    table_inertia_kg_m2: float
    bearing_friction_Nm: float
    ratio: float
    table_per_motor: float  # the reciprocal of the ratio
    half_gap_rad: float  # at the table
    tick_s: float
    inertial_torque_Nm_s: float  # at the table, for each rad/s of change of the motor's speed within a tick

    @classmethod
    def of(
        cls,
        motor: Motor,
        gears: Gears,
        friction: Friction,
        *,
        table_inertia_kg_m2: float,
        bearing_friction_Nm: float,
        tick_s: float,
    ) -> "DriveTrain":
        """Return the plant of these parts; `friction` is the friction of motor and gears at the motor's shaft."""
        motor_inertia = motor.rotor_inertia_kg_m2 + gears.inertia_kg_m2

        def coupling(torque_ratio: float) -> Coupling:
            inertia = table_inertia_kg_m2 * torque_ratio / gears.ratio
            return Coupling(discretize(motor, motor_inertia + inertia, tick_s), torque_ratio, inertia)

        return cls(
            free=discretize(motor, motor_inertia, tick_s),
            driving=coupling(1.0 / (gears.ratio * gears.efficiency)),
            overhauling=coupling(gears.efficiency / gears.ratio),
            friction=friction,
            torque_constant_Nm_A=motor.torque_constant_Nm_A,
            resistance_ohm=motor.resistance_ohm,
            current_decay=math.exp(-motor.resistance_ohm / motor.inductance_H * tick_s),
            motor_inertia_kg_m2=motor_inertia,
            table_inertia_kg_m2=table_inertia_kg_m2,
            bearing_friction_Nm=bearing_friction_Nm,
            ratio=gears.ratio,
            table_per_motor=1.0 / gears.ratio,
            half_gap_rad=math.radians(gears.backlash_arcmin / 60.0) / 2.0,
            tick_s=tick_s,
            inertial_torque_Nm_s=table_inertia_kg_m2 / (gears.ratio * tick_s),
        )


class DriveState(NamedTuple):
    """The state of the plant. Angles are unwrapped."""

    current_A: float
    speed_rad_s: float  # of the motor
    angle_rad: float  # of the motor
    table_speed_rad_s: float
    table_angle_rad: float
    contact: int  # 1 or -1: on the flank that drives forward or backward; 0: within the gap


def at_standstill(train: DriveTrain, gap_share: float) -> DriveState:
    """Return a plant at rest. `gap_share` (-1..1) is the position of the teeth from mid-gap to a flank."""
    contact = 1 if train.half_gap_rad == 0.0 else 0
    return DriveState(0.0, 0.0, 0.0, 0.0, -gap_share * train.half_gap_rad, contact)


def step(train: DriveTrain, state: DriveState, voltage_V: float, load_torque_Nm: float) -> DriveState:
    """Return the plant one tick later. The load torque at the table opposes positive rotation."""
    if state.contact == 0:
        return _free(train, state, voltage_V, load_torque_Nm)
    if state.speed_rad_s == 0.0:
        return _standing(train, state, voltage_V, load_torque_Nm)
    return _turning(train, state, voltage_V, load_torque_Nm)


def _turning(train: DriveTrain, state: DriveState, voltage_V: float, load_torque_Nm: float) -> DriveState:
    """In contact and moving. The friction is constant within the tick and has its initial value."""
    speed, contact = state.speed_rad_s, state.contact
    direction = 1 if speed > 0.0 else -1
    rigid = train.half_gap_rad == 0.0
    table_torque = direction * train.bearing_friction_Nm + load_torque_Nm
    friction = direction * sliding_torque_Nm(train.friction, speed)
    coupling = train.driving if rigid or direction == contact else train.overhauling
    current, next_speed, angle = _motor(
        coupling.motor, state, voltage_V, friction + coupling.torque_ratio * table_torque
    )
    tooth_torque = train.inertial_torque_Nm_s * (next_speed - speed) + table_torque
    if rigid and direction * tooth_torque < 0.0:
        coupling = train.overhauling
        current, next_speed, angle = _motor(
            coupling.motor, state, voltage_V, friction + coupling.torque_ratio * table_torque
        )
    elif contact * tooth_torque < 0.0 and not rigid:
        return _free(train, state, voltage_V, load_torque_Nm)
    if next_speed * direction <= 0.0:
        current = _standing_current(train, state.current_A, voltage_V)
        next_speed, angle = 0.0, _stopping_angle(state.angle_rad, speed, next_speed, train.tick_s)
    return _together(train, current, next_speed, angle, contact)


def _standing(train: DriveTrain, state: DriveState, voltage_V: float, load_torque_Nm: float) -> DriveState:
    """In contact and at rest: static friction holds, the motor breaks away, or one side leaves the flank."""
    contact, rigid = state.contact, train.half_gap_rad == 0.0
    current = _standing_current(train, state.current_A, voltage_V)
    torque = train.torque_constant_Nm_A * current
    pressed = contact * load_torque_Nm > train.bearing_friction_Nm
    pulled = contact * load_torque_Nm < -train.bearing_friction_Nm
    if not rigid and (pulled or (contact * torque < 0.0 and not pressed)):
        return _free(train, state, voltage_V, load_torque_Nm)
    for direction in (1, -1):
        table_torque = direction * train.bearing_friction_Nm + load_torque_Nm
        coupling = train.driving if direction * table_torque >= 0.0 else train.overhauling
        resisting = direction * train.friction.static_Nm + coupling.torque_ratio * table_torque
        if direction * (torque - resisting) > 0.0:
            next_current, next_speed, angle = _motor(coupling.motor, state, voltage_V, resisting)
            if direction * next_speed > 0.0:
                return _together(train, next_current, next_speed, angle, contact)
    return DriveState(current, 0.0, state.angle_rad, 0.0, state.table_angle_rad, contact)


def _free(train: DriveTrain, state: DriveState, voltage_V: float, load_torque_Nm: float) -> DriveState:
    """Within the gap: the motor runs alone and the table coasts, until they are in contact."""
    current, speed, angle = _lone_motor(train, state, voltage_V)
    table_speed, table_angle = _coasting_table(train, state, load_torque_Nm)
    gap = angle * train.table_per_motor - table_angle
    if abs(gap) < train.half_gap_rad:
        return DriveState(current, speed, angle, table_speed, table_angle, 0)
    contact = 1 if gap > 0.0 else -1
    gap_before = state.angle_rad * train.table_per_motor - state.table_angle_rad
    closing = gap - gap_before
    share = (contact * train.half_gap_rad - gap_before) / closing if contact * closing > 0.0 else 0.0
    share = min(max(share, 0.0), 1.0)
    common_speed = _speed_after_impact(train, contact, speed, table_speed * train.ratio)
    angle = state.angle_rad + share * (angle - state.angle_rad) + (1.0 - share) * train.tick_s * common_speed
    return _together(train, current, common_speed, angle, contact)


def _speed_after_impact(train: DriveTrain, contact: int, speed: float, table_speed: float) -> float:
    """Return the common speed of motor and table, at the motor, after contact on a flank.

    The impulse through the teeth includes the losses of the gears on the driven side. That is the table's side while
    the motor still turns toward the flank. If the table then drives the motor back, it is the motor's side.
    """
    motor, driven, driving = train.motor_inertia_kg_m2, train.driving.inertia_kg_m2, train.overhauling.inertia_kg_m2
    if contact * speed > 0.0:
        momentum = motor * speed + driven * table_speed
        if contact * momentum >= 0.0:
            return momentum / (motor + driven)
        speed, table_speed = 0.0, momentum / driven
    return (motor * speed + driving * table_speed) / (motor + driving)


def _lone_motor(train: DriveTrain, state: DriveState, voltage_V: float) -> tuple[float, float, float]:
    """Return current, speed and angle of a motor without the table one tick later."""
    speed = state.speed_rad_s
    direction = 1 if speed > 0.0 else -1
    resisting = direction * sliding_torque_Nm(train.friction, speed)
    if speed == 0.0:
        current = _standing_current(train, state.current_A, voltage_V)
        torque = train.torque_constant_Nm_A * current
        if abs(torque) <= train.friction.static_Nm:
            return current, 0.0, state.angle_rad
        direction = 1 if torque > 0.0 else -1
        resisting = direction * train.friction.static_Nm
    current, next_speed, angle = _motor(train.free, state, voltage_V, resisting)
    if next_speed * direction <= 0.0:
        current = _standing_current(train, state.current_A, voltage_V)
        return current, 0.0, _stopping_angle(state.angle_rad, speed, next_speed, train.tick_s)
    return current, next_speed, angle


def _coasting_table(train: DriveTrain, state: DriveState, load_torque_Nm: float) -> tuple[float, float]:
    """Return speed and angle of a table without the motor one tick later."""
    speed, angle = state.table_speed_rad_s, state.table_angle_rad
    if speed == 0.0:
        if abs(load_torque_Nm) <= train.bearing_friction_Nm:
            return speed, angle
        direction = -1 if load_torque_Nm > 0.0 else 1
    else:
        direction = 1 if speed > 0.0 else -1
    deceleration = (direction * train.bearing_friction_Nm + load_torque_Nm) / train.table_inertia_kg_m2
    next_speed = speed - deceleration * train.tick_s
    if next_speed * direction <= 0.0:
        return 0.0, _stopping_angle(angle, speed, next_speed, train.tick_s)
    return next_speed, angle + 0.5 * (speed + next_speed) * train.tick_s


def _motor(motor: MotorStep, state: DriveState, voltage_V: float, torque_Nm: float) -> tuple[float, float, float]:
    """Return current, speed and angle of the motor one tick later, against a resisting torque."""
    ii, iw, iv, im, wi, ww, wv, wm, ai, aw, av, am = motor  # the elements of the matrix `motor`: row, then column
    current, speed = state.current_A, state.speed_rad_s
    return (
        ii * current + iw * speed + iv * voltage_V + im * torque_Nm,
        wi * current + ww * speed + wv * voltage_V + wm * torque_Nm,
        state.angle_rad + ai * current + aw * speed + av * voltage_V + am * torque_Nm,
    )


def _standing_current(train: DriveTrain, current_A: float, voltage_V: float) -> float:
    """Return the current of a motor at rest one tick later: without back-EMF, only the inductance limits its change."""
    final = voltage_V / train.resistance_ohm
    return final + (current_A - final) * train.current_decay


def _stopping_angle(angle_rad: float, speed_rad_s: float, next_speed_rad_s: float, tick_s: float) -> float:
    """Return the position at which a body stops that would have reversed its direction within the tick."""
    change = speed_rad_s - next_speed_rad_s
    return angle_rad if change == 0.0 else angle_rad + 0.5 * speed_rad_s * tick_s * speed_rad_s / change


def _together(train: DriveTrain, current_A: float, speed_rad_s: float, angle_rad: float, contact: int) -> DriveState:
    """Return the plant with motor and table in contact on a flank."""
    table_angle = angle_rad * train.table_per_motor - contact * train.half_gap_rad
    return DriveState(current_A, speed_rad_s, angle_rad, speed_rad_s * train.table_per_motor, table_angle, contact)
