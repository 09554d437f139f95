import ctypes
from fractions import Fraction

import pytest
from hypothesis import given
from hypothesis import strategies as st

from emulator.firmware.fixed_point import from_fixed, to_fixed
from emulator.int32 import wrap_int32


@given(st.integers(-(2**62), 2**62))
def test_a_register_wraps_as_c_does(number: int) -> None:
    assert wrap_int32(number) == ctypes.c_int32(number).value


@given(st.fractions(), st.integers(0, 40))
def test_the_nearest_fixed_number_is_within_half_a_unit(value: Fraction, fraction_bits: int) -> None:
    assert abs(Fraction(to_fixed(value, fraction_bits), 1 << fraction_bits) - value) <= Fraction(1, 2 << fraction_bits)


@pytest.mark.parametrize(("value", "fixed"), [(0.5, 0), (1.5, 2), (2.5, 2), (-0.5, 0), (-1.5, -2)])
def test_halves_go_to_the_even_number(value: float, fixed: int) -> None:
    assert to_fixed(value, 0) == fixed


@given(st.integers(-(2**31), 2**31 - 1), st.integers(0, 26))
def test_a_fixed_number_survives_the_way_to_a_float_and_back(number: int, fraction_bits: int) -> None:
    assert to_fixed(from_fixed(number, fraction_bits), fraction_bits) == number
