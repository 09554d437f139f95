import numpy as np
import pytest
from numpy.testing import assert_allclose

from emulator.config.table_config import TableConfig
from tools.emulated import Array, Motion, emulate, motion_rows
from tools.identification.simulation import Standstill, wire_positions_deg

MOTIONS = [Motion(0.01, 2.0, 20.0, 100.0), Motion(0.5, -2.0, 20.0, 100.0)]
TICKS = np.arange(1.0, 1000.0)


def positions_deg(config: TableConfig, start: Standstill) -> Array:
    return wire_positions_deg(config, motion_rows(config, MOTIONS), TICKS, start)


def test_the_encoder_is_where_the_whole_emulator_has_it(assumed: TableConfig) -> None:
    answer = emulate(assumed, MOTIONS, 1.0)  # stands another way, so it is the same within a few counts only

    assert_allclose(positions_deg(assumed, Standstill()), answer.encoder_deg[TICKS.astype(int) - 1], atol=0.02)


@pytest.mark.parametrize(
    ("beyond", "within"),
    [
        (Standstill(1.3, 0.2), Standstill(0.3, 0.2)),
        (Standstill(0.3, 1.2), Standstill(0.3, 0.8)),
        (Standstill(0.3, -1.7), Standstill(0.3, -0.3)),
        (Standstill(-0.7, 4.2), Standstill(0.3, 0.2)),
    ],
)
def test_a_number_beyond_its_range_is_folded_back(beyond: Standstill, within: Standstill, assumed: TableConfig) -> None:
    assert_allclose(positions_deg(assumed, beyond), positions_deg(assumed, within), atol=1e-9)


def test_where_the_teeth_stand_shows_in_the_motion(assumed: TableConfig) -> None:
    apart_deg = positions_deg(assumed, Standstill(0.5, -1.0)) - positions_deg(assumed, Standstill(0.5, 1.0))

    assert np.abs(apart_deg).max() > 0.005
