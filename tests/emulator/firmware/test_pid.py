"""The fixed-point PID compared with its law in real numbers."""

from dataclasses import replace
from fractions import Fraction

import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from emulator.config.constants import firmware_constants, fixed_gains
from emulator.config.table_config import ConfigError, GainsConfig, load_config
from emulator.firmware.fixed_point import ERROR_BITS, OUTPUT_BITS
from emulator.firmware.pid import HOLD, RAMP, Gains, Pid, PidState, step
from emulator.int32 import INT32_MAX

DEFAULT = load_config()
COUNT = 1 << ERROR_BITS  # one count/window of demand
ONE_STEP = 1 << OUTPUT_BITS  # one PWM step of integral
REST = PidState(integral=0, measured=0, gain_set=HOLD, duty=0)

gains = st.builds(Gains, st.integers(0, 1 << 16), st.integers(1, 1 << 16), st.integers(0, 1 << 14))
gain_sets = st.sampled_from([RAMP, HOLD])


def regulator(ramp: Gains, hold: Gains | None = None) -> Pid:
    return Pid(ramp, hold or ramp, duty_max=1023)


@given(
    gains=gains,
    demands=st.lists(
        st.tuples(st.integers(-100 * COUNT, 100 * COUNT), st.integers(-100, 100)), min_size=1, max_size=30
    ),
)
def test_the_law_is_that_of_real_numbers_within_its_quantization(gains: Gains, demands: list[tuple[int, int]]) -> None:
    """u = K e + sum(Ki e) - Kd d(omega); the integral loses up to a unit of its last place a tick, u half a step."""
    parameters, state, integral = regulator(gains), REST, Fraction(0)
    for tick, (demand, measured) in enumerate(demands, start=1):
        change = measured - state.measured
        state = step(parameters, state, HOLD, demand, measured)
        error = Fraction(demand, COUNT) - measured
        integral += Fraction(gains.integral, 1 << 16) * error
        output = Fraction(gains.proportional, 1 << 12) * error + integral - Fraction(gains.derivative, 1 << 12) * change
        if max(abs(output), abs(integral)) > 1000:
            return  # other tests cover saturation
        assert abs(state.duty - output) <= Fraction(1, 2) + Fraction(tick, ONE_STEP)


@pytest.mark.parametrize("gains", [DEFAULT.gains.ramp, GainsConfig(0.02, 0.05, 0.0005)])
def test_gains_are_the_configured_ones_in_the_firmwares_units(gains: GainsConfig) -> None:
    """A count in a window of 8 ms is 1/512 deg in 8 ms, and full duty 1023 steps."""
    fixed = fixed_gains(DEFAULT, gains)
    count_deg_s = 1.0 / 512.0 / 0.008
    proportional = gains.proportional_duty_s_deg * count_deg_s * 1023
    assert fixed.proportional / 2**12 == pytest.approx(proportional, abs=2**-13)
    assert fixed.integral / 2**16 == pytest.approx(proportional * 0.001 / gains.integral_time_s, abs=2**-17)
    assert fixed.derivative / 2**12 == pytest.approx(proportional * gains.derivative_time_s / 0.001, abs=2**-13)


@given(
    ramp=gains,
    hold=gains,
    demand=st.integers(-20 * COUNT, 20 * COUNT),
    measured=st.integers(-20, 20),
    ticks=st.integers(0, 20),
)
def test_switching_the_gain_set_does_not_move_the_duty(
    ramp: Gains, hold: Gains, demand: int, measured: int, ticks: int
) -> None:
    """Except for one tick's integral, at a constant error; a duty at its limit may differ."""
    parameters, state = regulator(ramp, hold), REST
    for _ in range(ticks + 1):
        state = step(parameters, state, HOLD, demand, measured)
    switched = step(parameters, state, RAMP, demand, measured)
    assume(abs(state.duty) < 1023)
    assume(abs(switched.integral) < 1023 * ONE_STEP)
    growth = abs(Fraction(ramp.integral * (demand - measured * COUNT), ONE_STEP << 4))
    # the derivative of the previous tick may have acted for the last time
    kick = Fraction(hold.derivative * abs(measured), 1 << 12) if ticks == 0 else 0
    assert abs(switched.duty - state.duty) <= growth + kick + 1


@given(gains=gains, excess=st.integers(1, 8000), ticks=st.integers(1, 3000))
def test_a_saturated_duty_comes_down_as_soon_as_the_error_turns(gains: Gains, excess: int, ticks: int) -> None:
    """Anti-windup: however long the saturation, the integral alone never exceeds full duty."""
    parameters, state = regulator(gains), REST
    for _ in range(min(ticks, 200)):
        state = step(parameters, state, HOLD, excess * COUNT, 0)
        assert abs(state.integral) <= 1023 * ONE_STEP
    assume(state.duty == 1023)
    error_after = -(1 + (ONE_STEP + (1 << 4)) // max(1, gains.proportional, gains.integral >> 4))
    assert step(parameters, state, HOLD, error_after, 0).duty < 1023


@given(gains=gains, sign=st.sampled_from([-1, 1]), excess=st.integers(1, 100), ticks=st.integers(1, 50))
def test_a_duty_that_the_error_alone_saturates_adds_nothing_to_the_integral(
    gains: Gains, sign: int, excess: int, ticks: int
) -> None:
    """Anti-windup, at both ends: then the duty follows the error as soon as that is small again."""
    assume(gains.proportional > 0)
    error = sign * (1023 * ONE_STEP // gains.proportional + excess)
    assume(abs(error) < 8000 * COUNT)
    parameters, state = regulator(gains), REST
    for _ in range(ticks):
        state = step(parameters, state, HOLD, error, 0)
        assert (state.duty, state.integral) == (sign * 1023, 0)
    assert step(parameters, state, HOLD, 0, 0).duty == 0


@given(gains=gains, step_of_demand=st.integers(-50 * COUNT, 50 * COUNT))
def test_a_step_of_the_reference_gives_no_derivative_kick(gains: Gains, step_of_demand: int) -> None:
    without = gains._replace(derivative=0)
    assert step(regulator(gains), REST, HOLD, step_of_demand, 0) == step(
        regulator(without), REST, HOLD, step_of_demand, 0
    )


def test_the_derivative_brakes_a_speed_that_rises() -> None:
    parameters = regulator(Gains(proportional=0, integral=1, derivative=5 << 12))
    assert step(parameters, REST, HOLD, 3 * COUNT, 3).duty == -15
    assert step(parameters, REST._replace(measured=3), HOLD, 3 * COUNT, 3).duty == 0


@given(
    gains=st.builds(Gains, *[st.integers(0, INT32_MAX)] * 3),
    state=st.builds(
        PidState, st.integers(-1023 * ONE_STEP, 1023 * ONE_STEP), st.integers(-2000, 2000), gain_sets, st.just(0)
    ),
    gain_set=gain_sets,
    demand=st.integers(-2000 * COUNT, 2000 * COUNT),
    measured=st.integers(-2000, 2000),
)
def test_whatever_comes_duty_and_registers_keep_their_ranges(
    gains: Gains, state: PidState, gain_set: int, demand: int, measured: int
) -> None:
    after = step(regulator(gains, gains), state, gain_set, demand, measured)
    assert abs(after.duty) <= 1023
    assert abs(after.integral) <= min(INT32_MAX, 1023 * ONE_STEP)


@pytest.mark.parametrize(
    "gains", [GainsConfig(0.0, 1.0, 0.0), GainsConfig(1e6, 1.0, 0.0), GainsConfig(0.012, 1e6, 0.0)]
)
def test_gains_that_the_registers_cannot_hold_are_refused(gains: GainsConfig) -> None:
    with pytest.raises(ConfigError, match="does not fit the firmware"):
        firmware_constants(replace(DEFAULT, gains=replace(DEFAULT.gains, hold=gains)))
