import math

import pytest

from protocol.conformance.judgement.verdict import Measurement, Verdict


@pytest.mark.parametrize(
    ("value", "least", "most", "verdict"),
    [
        (5.0, 0.0, 10.0, Verdict.PASS),
        (0.5, 0.0, 10.0, Verdict.MARGINAL),
        (9.5, 0.0, 10.0, Verdict.MARGINAL),
        (10.0, 0.0, 10.0, Verdict.MARGINAL),
        (10.1, 0.0, 10.0, Verdict.FAIL),
        (-0.1, 0.0, 10.0, Verdict.FAIL),
        (8.0, None, 10.0, Verdict.PASS),
        (9.5, None, 10.0, Verdict.MARGINAL),
        (11.0, None, 10.0, Verdict.FAIL),
        (12.0, 10.0, None, Verdict.PASS),
        (10.5, 10.0, None, Verdict.MARGINAL),
        (9.0, 10.0, None, Verdict.FAIL),
        (20.0 - 19.9, -0.1, 0.1, Verdict.MARGINAL),  # 0.10000000000000142 in binary
        (math.nan, 0.0, 10.0, Verdict.FAIL),
    ],
)
def test_a_measurement_is_judged_by_its_range(
    value: float, least: float | None, most: float | None, verdict: Verdict
) -> None:
    assert Measurement("length", value, "mm", least, most).verdict is verdict


def test_a_measurement_reads_as_a_sentence() -> None:
    assert str(Measurement("wait", 3.0, "ms", most=10.0)) == "wait 3 ms (allowed: at most 10)"
    assert str(Measurement("wait", 3.0, "ms", 1.0, 10.0)) == "wait 3 ms (allowed: 1 to 10)"
    assert str(Measurement("wait", 3.0, "ms", least=1.0)) == "wait 3 ms (allowed: at least 1)"


@pytest.mark.parametrize(
    ("value", "least", "most", "margin"),
    [
        (5.0, 0.0, 10.0, 0.5),
        (9.0, 0.0, 10.0, 0.1),
        (12.0, 0.0, 10.0, -0.2),
        (3.0, None, 4.0, 0.25),
        (6.0, 4.0, None, 0.5),
        (7.0, 7.0, 7.0, float("inf")),
        (8.0, 7.0, 7.0, float("-inf")),
        (0.0, None, 0.0, float("inf")),
    ],
)
def test_a_margin_is_the_share_of_the_range_to_its_nearer_end(
    value: float, least: float | None, most: float | None, margin: float
) -> None:
    assert Measurement("speed", value, "deg/s", least, most).margin == pytest.approx(margin)
