import argparse

import pytest

from protocol.program.number_options import positive_number, whole_number


@pytest.mark.parametrize("text", ["8", " 9 ", "360"])
def test_a_whole_number_within_its_bounds_is_read(text: str) -> None:
    assert whole_number(8, 360)(text) == int(text)


@pytest.mark.parametrize("text", ["7", "361", "8.0", "eight", ""])
def test_another_number_is_refused_with_what_is_allowed(text: str) -> None:
    with pytest.raises(argparse.ArgumentTypeError, match=rf"is {text}; allowed: a whole number from 8 to 360"):
        whole_number(8, 360)(text)


@pytest.mark.parametrize("text", ["0", "-1", "nan", "inf", "1e9", "fast"])
def test_a_number_that_is_not_above_0_is_refused(text: str) -> None:
    with pytest.raises(argparse.ArgumentTypeError, match=f"is {text}; allowed: a number above 0 and at most 1000"):
        positive_number(text)
