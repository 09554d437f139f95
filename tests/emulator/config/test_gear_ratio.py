"""A ratio as a float represents the fraction from which it was computed."""

from fractions import Fraction

from hypothesis import given
from hypothesis import strategies as st

from emulator.config.gear_ratio import simplest_fraction
from protocol.files.toml_table import TomlTable

teeth = st.integers(1, 60_000)


def ratio_in(text: str) -> float:
    return TomlTable("gears", {"ratio": text}).number("ratio", fraction=True)


@given(driven=teeth, driving=teeth)
def test_a_ratio_of_teeth_survives_the_way_through_a_float(driven: int, driving: int) -> None:
    assert simplest_fraction(ratio_in(f"{driven}/{driving}")) == Fraction(driven, driving)
    assert simplest_fraction(driven / driving) == Fraction(driven, driving)


@given(st.decimals(1, 100_000, places=4))
def test_a_decimal_number_of_a_datasheet_stands_for_itself(ratio: Fraction) -> None:
    assert simplest_fraction(float(ratio)) == Fraction(ratio)


@given(st.floats(1e-6, 1e6))
def test_the_fraction_is_the_simplest_of_those_whose_nearest_float_is_the_ratio(value: float) -> None:
    simplest = simplest_fraction(value)
    assert float(simplest) == value
    if simplest.denominator > 1:
        assert float(Fraction(value).limit_denominator(simplest.denominator - 1)) != value
