from math import copysign

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tools.identification.excitation import Reference, excitation
from tools.identification.lag_tracker import LagTracker, next_passage_s


def test_rounded_readings_tell_the_lag() -> None:
    burst = excitation(60.0, 40.0, 100.0, seed=0)[-1]
    tracker = LagTracker()

    def lag_deg(reference: Reference) -> float:
        return 5e-3 * reference.speed_deg_s + copysign(0.08, reference.speed_deg_s)

    references = [burst.reference(time_s) for time_s in np.arange(0.05, burst.end_s, 0.0113)]
    for reference in references:
        seen_deg = round(reference.angle_deg - lag_deg(reference), 1)
        tracker.learn(reference, reference.angle_deg - seen_deg - 0.05, reference.angle_deg - seen_deg + 0.05)

    for reference in references[-50:]:
        assert tracker.lag_deg(reference) == pytest.approx(lag_deg(reference), abs=0.01)


def test_readings_of_a_table_that_slipped_never_break_the_recorder() -> None:
    tracker, chance = LagTracker(), np.random.default_rng(1)
    references = [Reference(0.0, speed, 100.0 * np.sign(speed)) for speed in chance.uniform(-40.0, 40.0, 20_000)]

    for count, reference in enumerate(references):
        low_deg = 5.0 if count < 15_000 else 0.1 * copysign(1.0, reference.speed_deg_s) - 0.05
        tracker.learn(reference, low_deg, low_deg + 0.1)

    assert abs(tracker.lag_deg(references[-1])) == pytest.approx(0.1, abs=0.05)


@given(st.floats(-30.0, 30.0), st.floats(-100.0, 100.0))
def test_at_the_next_passage_a_steady_motion_is_between_two_decimals(speed_deg_s: float, start_deg: float) -> None:
    passage_s = next_passage_s(lambda time_s: start_deg + speed_deg_s * time_s, 0.1, 0.0, 0.02)

    between = (start_deg + speed_deg_s * passage_s) / 0.1 - 0.5
    assert passage_s == 0.0 or abs(between - round(between)) < 1e-6
    assert 0.0 <= passage_s <= 0.022
    assert passage_s > 0.0 or abs(speed_deg_s) < 5.0 or abs(between - round(between)) < 1e-6
