"""Tables with other encoders, gears and ticks: each state fits its registers, and each motion ends at its target."""

import random
from dataclasses import replace
from fractions import Fraction
from itertools import product
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from emulator.config.constants import firmware_constants
from emulator.config.table_config import TableConfig, load_config
from emulator.firmware.controller import FirmwareState, begin_motion, power_on, step
from emulator.firmware.fixed_point import to_fixed
from emulator.firmware.pid import HOLD, RAMP, Gains, Pid, PidState
from emulator.firmware.pid import step as regulator_step
from emulator.firmware.profiler import Profile
from emulator.int32 import INT32_MAX
from emulator.table.batch import COLUMNS, MOVE_BY, MOVE_TO, advance, run
from emulator.table.interpreter import Interpreter
from emulator.table.machine_code import compiled
from emulator.table.table import Table
from protocol.messages import Command, Verb

DEFAULT = load_config()
NAMED = {
    "500 lines at 1:480": "[encoder]\nlines = 500",
    "256 lines at 1:480": "[encoder]\nlines = 256",
    "1000 lines at 1:100": "[encoder]\nlines = 1000\n[gears]\nratio = 100",
    "10 000 lines at 1:480": "[encoder]\nlines = 10000",
    "a tick of 5 ms": "[control]\ntick_hz = 200",
    "a window of 8 ms at 10 kHz": "[control]\ntick_hz = 10000\nspeed_window_ticks = 80",
    "2197/27": "[gears]\nratio = '2197/27'",
    "498.9": "[gears]\nratio = 498.9",
    "fast": "[limits]\nspeed_deg_s = 720\nacceleration_deg_s2 = 20000",
}


@pytest.fixture(params=NAMED)
def config(request: pytest.FixtureRequest, tmp_path: Path) -> TableConfig:
    """A table that only the wider formats allow; its gains do not matter in these tests."""
    path = tmp_path / "table.toml"
    path.write_text(NAMED[request.param], encoding="utf-8")
    return load_config(path).with_serial(baud=0)


def motion_of(config: TableConfig, angle_deg: float, speed_deg_s: float, acceleration_deg_s2: float) -> list[int]:
    count_deg, tick_hz, bits = config.counts_per_turn / 360, config.control.tick_hz, config.motion_bits
    return [
        to_fixed(Fraction(angle_deg) * count_deg, bits),
        to_fixed(Fraction(speed_deg_s) * count_deg / tick_hz, bits),
        to_fixed(Fraction(acceleration_deg_s2) * count_deg / tick_hz**2, bits),
    ]


def fits_registers(state: FirmwareState, bits: int) -> bool:
    reference = state.reference
    words = (*state.counts, reference.position_count, reference.speed, *state.profile[:2], state.pid.integral)
    return (
        all(-INT32_MAX - 1 <= word <= INT32_MAX for word in words)
        and 0 <= reference.fraction < 1 << bits
        and 0 <= reference.distance_fraction < 1 << bits
        and abs(reference.distance_count) < 1 << (63 - bits)
    )


def test_the_default_table_has_26_fraction_bits() -> None:
    assert DEFAULT.motion_bits == 26


def test_a_motion_at_the_limits_ends_on_its_target_and_fits_the_registers(config: TableConfig) -> None:
    """A shaft that follows the reference: 3.7 deg forward, and 1.2 deg back."""
    parameters, bits = firmware_constants(config), config.motion_bits
    tick_hz, limits = config.control.tick_hz, config.limits
    for angle_deg in (3.7, -1.2):
        distance, speed, acceleration = motion_of(config, angle_deg, limits.speed_deg_s, limits.acceleration_deg_s2)
        state = power_on(parameters, Profile.of(1, 1), 0)
        state = begin_motion(state, Profile.of(speed, acceleration), distance, bits)
        for _ in range(3 * tick_hz):
            state = step(parameters, state, state.reference.position_count)
            assert fits_registers(state, bits)
            if state.reference.speed == 0 and state.motion != 1:
                break
        reference = state.reference
        assert (reference.position_count << bits) + reference.fraction == distance


def test_interpreted_and_compiled_agree_to_the_last_bit(config: TableConfig) -> None:
    if config.control.speed_window_ticks != DEFAULT.control.speed_window_ticks:
        pytest.skip("numba would compile the whole tick anew for another length of the window")
    chance = random.Random(repr(config))  # noqa: S311  # a test's draw
    table, limits, ticks = Table(config, seed=1), config.limits, config.control.tick_hz // 2
    snapshot = table.snapshot()
    motions = np.array(
        [
            (
                tick,
                chance.choice([MOVE_TO, MOVE_BY]),
                *motion_of(
                    config,
                    chance.uniform(-10.0, 10.0),
                    chance.uniform(0.1, 1.0) * limits.speed_deg_s,
                    chance.uniform(0.1, 1.0) * limits.acceleration_deg_s2,
                ),
            )
            for tick in sorted(chance.randrange(ticks) for _ in range(5))
        ]
    )
    loads = np.array([(ticks // 3, 1.0)])
    samples = np.empty((ticks // 7, len(COLUMNS)))
    interpreted = advance(
        snapshot.constants, snapshot.state, ticks, motions.astype(object), loads.astype(object), 7, samples
    )
    compiled, compiled_samples = run(snapshot.constants, snapshot.state, ticks, motions, loads, every=7)
    assert repr(compiled) == repr(interpreted)
    assert compiled_samples.tobytes() == samples.tobytes()
    assert fits_registers(interpreted.firmware, config.motion_bits)


@settings(max_examples=200)
@given(
    lines=st.integers(1, 10_000),
    ratio=st.fractions(1, 1000, max_denominator=50),
    tick_hz=st.integers(100, 20_000),
    speed_deg_s=st.floats(0.5, 400.0),
    acceleration_deg_s2=st.floats(1.0, 1e4),
)
def test_the_greatest_speed_and_acceleration_fit_and_no_bit_is_given_away(
    lines: int, ratio: Fraction, tick_hz: int, speed_deg_s: float, acceleration_deg_s2: float
) -> None:
    config = replace(
        DEFAULT,
        encoder=replace(DEFAULT.encoder, lines=lines),
        gears=replace(DEFAULT.gears, ratio=float(ratio)),
        control=replace(DEFAULT.control, tick_hz=tick_hz),
        limits=replace(DEFAULT.limits, speed_deg_s=speed_deg_s, acceleration_deg_s2=acceleration_deg_s2),
    )
    assert config.counts_per_turn == 4 * lines * ratio
    _, speed, acceleration = motion_of(config, 0.0, speed_deg_s, acceleration_deg_s2)
    assert speed + acceleration <= INT32_MAX
    assert config.motion_bits == 30 or speed + acceleration >= INT32_MAX // 2 - 1


@pytest.mark.parametrize(("lines", "ratio"), [(96, 2197 / 27), (96, 498.9), (500, 480.0), (1024, 1e6 / 7919)])
def test_a_million_turns_do_not_drift(lines: int, ratio: float) -> None:
    """The sum of a million whole turns, each rounded to the register, compared with fractions.

    The reading of counts is compared too.
    """
    config = replace(DEFAULT, encoder=replace(DEFAULT.encoder, lines=lines), gears=replace(DEFAULT.gears, ratio=ratio))
    interpreter, turn = Interpreter(config), 4 * lines * Fraction(ratio).limit_denominator(10_000)
    registers = interpreter.power_on()
    woken = power_on(firmware_constants(config), Profile.of(1, 1), 0)
    _, moving, _ = interpreter.execute(Command(Verb.MOVE_BY, 360), woken, registers)  # type: ignore[arg-type]  # exact
    reference, bits = moving.reference, config.motion_bits
    made = Fraction((reference.distance_count << bits) + reference.distance_fraction, 1 << bits)
    assert abs(1_000_000 * (made - turn)) < Fraction(1, 16)  # counts
    for turns in (1, 999, 1_000_000):
        count = round(turns * turn)
        assert abs(Fraction(interpreter.angle_deg(count)) - count * 360 / turn) <= Fraction(1, 10**10)


def test_a_table_does_not_creep_faster_than_its_limit() -> None:
    config = replace(
        DEFAULT,
        limits=replace(DEFAULT.limits, speed_deg_s=0.3),
        power_on=replace(DEFAULT.power_on, speed_deg_s=0.3),
    )
    assert firmware_constants(config).approach_speed == motion_of(config, 0.0, 0.3, 1.0)[1]


@pytest.mark.parametrize("gain_set", [RAMP, HOLD])
def test_no_product_of_the_regulator_leaves_64_bits(gain_set: int) -> None:
    """Compiled, 64 bits wrap without an error; interpreted, integers have any length: both must agree."""
    widest = Gains(INT32_MAX, INT32_MAX, INT32_MAX)
    regulator = Pid(widest, Gains(1, INT32_MAX, INT32_MAX), duty_max=2047)
    step_64 = compiled(regulator_step)
    ends = (-INT32_MAX - 1, -1, 0, INT32_MAX)
    for demand, measured, before, integral in product(ends, ends, ends, (-(2047 << 20), 0, 2047 << 20)):
        state = PidState(integral, before, RAMP, 0)
        after = regulator_step(regulator, state, gain_set, demand, measured)
        assert tuple(step_64(regulator, state, gain_set, demand, measured)) == tuple(after)
