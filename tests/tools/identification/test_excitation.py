from random import Random

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from emulator.config.table_config import TableConfig
from tools.emulated import Motion, emulate
from tools.identification.excitation import Burst, excitation


@pytest.mark.parametrize("index", range(14))
def test_the_firmware_runs_a_burst_as_predicted_whenever_in_the_braking_the_targets_come(
    index: int, assumed: TableConfig
) -> None:
    burst = excitation(60.0, 40.0, 100.0, seed=0)[index]
    chance = Random(index)  # noqa: S311  # not for security

    answer = emulate(assumed, motions(burst, chance), burst.duration_s)

    predicted = [burst.reference(time_s) for time_s in answer.time_s]
    np.testing.assert_allclose(answer.reference_deg, [each.angle_deg for each in predicted], atol=0.02)
    np.testing.assert_allclose(answer.reference_speed_deg_s, [each.speed_deg_s for each in predicted], atol=0.2)


def motions(burst: Burst, chance: Random) -> list[Motion]:
    """Return the commands of a burst; all except the first are early or late by up to 40 ms."""
    return [
        Motion(
            move.send_s + (chance.uniform(-0.04, 0.04) if move.send_s else 0.0),
            move.to_deg,
            40.0,
            burst.acceleration_deg_s2,
        )
        for move in burst.moves
    ]


@given(st.floats(1.0, 40.0), st.floats(1.0, 100.0), st.floats(10.0, 200.0))
@settings(max_examples=50)
def test_no_limit_is_passed(speed_deg_s: float, acceleration_deg_s2: float, duration_s: float) -> None:
    bursts = excitation(duration_s, speed_deg_s, acceleration_deg_s2, seed=0)

    for burst in bursts:
        ends_deg = [abs(move.to_deg - move.from_deg) for move in burst.moves]
        assert burst.acceleration_deg_s2 <= acceleration_deg_s2
        assert (burst.acceleration_deg_s2 * max(ends_deg)) ** 0.5 < speed_deg_s
        assert burst.moves[-1].to_deg == 0.0


def test_by_default_it_takes_a_minute_within_a_quarter_of_a_turn() -> None:
    bursts = excitation(60.0, 40.0, 100.0, seed=0)

    assert sum(burst.duration_s for burst in bursts) == pytest.approx(60.0, abs=1.0)
    assert max(abs(move.to_deg) for burst in bursts for move in burst.moves) < 45.0
