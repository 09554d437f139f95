"""The effect of each verb on the controller and its registers, without plant or line."""

from dataclasses import replace
from decimal import Decimal
from fractions import Fraction

import pytest
from hypothesis import given
from hypothesis import strategies as st

from emulator.config.constants import firmware_constants
from emulator.config.table_config import load_config
from emulator.firmware.controller import MOVING, FirmwareState, power_on
from emulator.firmware.profiler import Profile, Reference
from emulator.int32 import INT32_MAX
from emulator.table.interpreter import CARRIED_OUT, Interpreter, Registers
from protocol.codec import encode_reply
from protocol.messages import VERBS, Angle, Command, ErrorCode, Ok, Refusal, Reply, Verb

CONFIG = load_config()
INTERPRETER = Interpreter(CONFIG)
REGISTERS = INTERPRETER.power_on()
ONE = 1 << 26
OUT_OF_RANGE = Refusal(ErrorCode.OUT_OF_RANGE)


def controller(reference: Reference = Reference(0, 0, 0, 0, 0), count: int = 0) -> FirmwareState:  # noqa: B008  # immutable
    woken = power_on(firmware_constants(CONFIG), Profile.of(REGISTERS.speed, REGISTERS.acceleration), count)
    return woken._replace(reference=reference)


def execute(
    verb: Verb, value: str | None = None, state: FirmwareState | None = None, registers: Registers = REGISTERS
) -> tuple[Reply, FirmwareState, Registers]:
    number = None if value is None else Decimal(value)
    return INTERPRETER.execute(Command(verb, number), state or controller(), registers)


def test_every_verb_of_table_1_is_carried_out() -> None:
    assert CARRIED_OUT.keys() == VERBS.keys() == set(Verb)


def test_a_verb_that_the_table_does_not_carry_out_is_refused_as_unknown(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delitem(CARRIED_OUT, Verb.READ_LATCH)
    state = controller()
    assert execute(Verb.READ_LATCH, None, state) == (Refusal(ErrorCode.UNKNOWN_COMMAND), state, REGISTERS)


def distance(state: FirmwareState) -> int:
    return (state.reference.distance_count << 26) + state.reference.distance_fraction


def test_power_on_takes_speed_and_acceleration_from_the_configuration() -> None:
    assert Registers(round(10 * 0.512 * ONE), round(20 * 0.000512 * ONE), 0) == REGISTERS


@pytest.mark.parametrize("limit", ["33.3", "0.1", "40"])
def test_a_limit_holds_for_the_decimal_that_the_file_states(limit: str) -> None:
    value = float(limit)
    motion = replace(CONFIG.limits, speed_deg_s=value, acceleration_deg_s2=value)
    interpreter = Interpreter(replace(CONFIG, limits=motion))
    for verb in (Verb.SET_SPEED, Verb.SET_ACCELERATION):
        at_limit = interpreter.execute(Command(verb, Decimal(limit)), controller(), REGISTERS)[0]
        above = interpreter.execute(Command(verb, Decimal(limit) + Decimal("1e-25")), controller(), REGISTERS)[0]
        assert (at_limit, above) == (Ok(), OUT_OF_RANGE)


def test_an_angle_just_below_half_a_digit_is_not_rounded_twice() -> None:
    config = replace(
        CONFIG, encoder=replace(CONFIG.encoder, lines=97), gears=replace(CONFIG.gears, ratio=1009.0)
    ).with_serial(decimals=6)
    turn = int(config.counts_per_turn)
    for nearest in range(-9, 10, 2):  # distance of the angle of the count from the middle between two digits
        count = (turn // 4 + nearest) // 2 * pow(90_000_000, -1, turn // 4) % (turn // 4)
        angle = Interpreter(config).angle_deg(count)
        digits = Fraction(count * 360, turn) * 10**6
        assert 0 < abs(digits % 1 - Fraction(1, 2)) < Fraction(1, 10**4)
        assert encode_reply(Angle(Verb.READ_POSITION, angle), 6) == b"H %d.%06d\r" % divmod(round(digits), 10**6)


@pytest.mark.parametrize("count", [0, 1, -1, 512, INT32_MAX, -INT32_MAX - 1])
def test_h_reads_the_encoder_and_l_the_latch_neither_changes_anything(count: int) -> None:
    state, registers = controller(count=count), REGISTERS._replace(latched_count=-count)
    expected = Angle(Verb.READ_POSITION, Decimal(count) / 512)
    assert execute(Verb.READ_POSITION, None, state, registers) == (expected, state, registers)
    assert execute(Verb.READ_LATCH, None, state, registers)[0] == Angle(Verb.READ_LATCH, Decimal(-count) / 512)


@given(count=st.integers(-INT32_MAX, INT32_MAX), lines=st.integers(1, 9999))
def test_an_angle_is_exact_to_ten_decimals_on_any_encoder(count: int, lines: int) -> None:
    interpreter = Interpreter(replace(CONFIG, encoder=replace(CONFIG.encoder, lines=lines)))
    exact = Fraction(count * 360, 4 * lines * 480)
    assert abs(Fraction(interpreter.angle_deg(count)) - exact) <= Fraction(1, 2 * 10**10)


@pytest.mark.parametrize(
    ("verb", "name", "unit"),
    [(Verb.SET_SPEED, "speed", "0.512"), (Verb.SET_ACCELERATION, "acceleration", "0.000512")],
)
@pytest.mark.parametrize("value", ["0.1", "7.3", "40", "0.123456789"])
def test_s_and_a_set_their_register_alone_rounded_to_its_unit(verb: Verb, name: str, unit: str, value: str) -> None:
    state = controller()
    reply, after, registers = execute(verb, value, state)
    assert reply == Ok()
    assert after is state
    assert registers == REGISTERS._replace(**{name: round(Fraction(value) * Fraction(unit) * ONE)})


@pytest.mark.parametrize(
    ("verb", "value"),
    [
        (Verb.SET_SPEED, "0"),
        (Verb.SET_SPEED, "-0.1"),
        (Verb.SET_SPEED, "40.0000001"),
        (Verb.SET_SPEED, "0.00000001"),  # less than half a unit of its register
        (Verb.SET_ACCELERATION, "0"),
        (Verb.SET_ACCELERATION, "-5"),
        (Verb.SET_ACCELERATION, "100.1"),
        (Verb.SET_ACCELERATION, "0.00001"),
        (Verb.MOVE_TO, "4194304"),
        (Verb.MOVE_TO, "4194303.9981"),  # beyond the last count
        (Verb.MOVE_TO, "-4194304.0000001"),
        (Verb.MOVE_TO, "-4194304"),  # from beyond 0: longer than half the range
        (Verb.MOVE_BY, "99999999999999"),
        (Verb.MOVE_BY, "4194304.0000001"),
        (Verb.MOVE_BY, "-4194304.0000001"),
    ],
)
def test_what_is_out_of_range_changes_nothing(verb: Verb, value: str) -> None:
    state = controller(Reference(5, 6, 7, 8, 9))
    assert execute(verb, value, state) == (OUT_OF_RANGE, state, REGISTERS)


def test_a_way_longer_than_the_counter_is_refused_though_both_its_ends_are_in_range() -> None:
    state = controller(Reference(-INT32_MAX, 0, 0, 0, 0))
    assert execute(Verb.MOVE_TO, "4194303", state) == (OUT_OF_RANGE, state, REGISTERS)


def test_a_motion_takes_speed_and_acceleration_as_they_are_when_it_begins() -> None:
    _, state, registers = execute(Verb.SET_SPEED, "33")
    _, state, registers = execute(Verb.SET_ACCELERATION, "44", state, registers)
    _, moving, _ = execute(Verb.MOVE_BY, "1", state, registers)
    assert (moving.motion, moving.profile) == (MOVING, Profile.of(registers.speed, registers.acceleration))
    _, after, registers = execute(Verb.SET_SPEED, "2", moving, registers)
    assert after is moving, "S never changes the motion that is running"
    assert execute(Verb.MOVE_BY, "1", after, registers)[1].profile.speed == registers.speed < moving.profile.speed


def test_r_is_relative_to_the_reference_and_p_is_absolute() -> None:
    """Neither to the encoder, nor to a target that was not reached."""
    moving = controller(Reference(1000, ONE // 4, 5 * ONE, 300, 7), count=900)
    by, to = execute(Verb.MOVE_BY, "1", moving)[1], execute(Verb.MOVE_TO, "1", moving)[1]
    assert distance(by) == 512 * ONE
    assert distance(to) == (512 - 1000) * ONE - ONE // 4
    for after in (by, to):
        assert after.reference[:3] == moving.reference[:3], "position and speed go on"


@given(steps=st.lists(st.integers(-(10**6), 10**6), min_size=1, max_size=30), decimals=st.integers(0, 4))
def test_increments_accumulate_no_rounding_beyond_a_unit_each(steps: list[int], decimals: int) -> None:
    state, total = controller(), Fraction(0)
    for number in steps:
        value = Decimal(number).scaleb(-decimals)
        reply, moving, _ = execute(Verb.MOVE_BY, str(value), state)
        if reply == OUT_OF_RANGE:
            return
        total += Fraction(value) * 512
        position = (moving.reference.position_count << 26) + moving.reference.fraction + distance(moving)
        assert abs(Fraction(position, ONE) - total) <= Fraction(len(steps), 2 * ONE)
        state = moving._replace(reference=Reference(position >> 26, position % ONE, 0, 0, 0))
        if abs(position >> 26) > INT32_MAX:
            return
