"""The compiled tick compared with the interpreted one: the same source, so bit-identical states."""

import random

import numpy as np
import pytest

from emulator.config.table_config import load_config
from emulator.table.batch import COLUMNS, MOVE_BY, MOVE_TO, Loads, Motions, advance, run
from emulator.table.table import Table

CONFIG = load_config().with_serial(baud=0)
DEG = 512 << 26
DEG_S = DEG / 1000
TICKS = 4000


def random_motions(chance: random.Random) -> Motions:
    ticks = sorted(chance.randrange(TICKS) for _ in range(8))
    rows = [
        (
            tick,
            chance.choice([MOVE_TO, MOVE_BY]),
            round(chance.choice([0.0, chance.uniform(-20.0, 20.0), chance.uniform(-1.0, 1.0)]) * DEG),
            round(chance.uniform(0.1, 40.0) * DEG_S),
            round(chance.uniform(1.0, 100.0) * DEG_S / 1000),
        )
        for tick in ticks
    ]
    return np.array(rows, dtype=np.int64)


def random_loads(chance: random.Random) -> Loads:
    ticks = sorted(chance.randrange(TICKS) for _ in range(3))
    return np.array([(tick, chance.uniform(-3.0, 3.0)) for tick in ticks])


@pytest.mark.parametrize("seed", range(8))
def test_interpreted_and_compiled_agree_to_the_last_bit(seed: int) -> None:
    """Random motions and loads, including strong ones that stall the table."""
    chance = random.Random(seed)  # noqa: S311  # a test's draw
    snapshot = Table(CONFIG, seed).snapshot()
    motions, loads = random_motions(chance), random_loads(chance)
    samples = np.empty((TICKS // 7, len(COLUMNS)))
    interpreted = advance(
        snapshot.constants, snapshot.state, TICKS, motions.astype(object), loads.astype(object), 7, samples
    )  # as objects: Python's own numbers, as in the emulator
    compiled, compiled_samples = run(snapshot.constants, snapshot.state, TICKS, motions, loads, every=7)
    assert repr(compiled) == repr(interpreted)
    assert compiled_samples.tobytes() == samples.tobytes()


def test_a_batch_is_what_the_emulator_does() -> None:
    """The same motion by command and by row; samples contain the values of the status."""
    table = Table(CONFIG, seed=3)
    snapshot = table.snapshot()
    table.receive(b"S 20\rA 50\rR -30\r")
    table.advance(1500)
    motions = np.array([(0, MOVE_BY, -30 * DEG, round(20 * DEG_S), round(50 * DEG_S / 1000))])
    state, samples = run(snapshot.constants, snapshot.state, 1500, motions)
    assert repr(state) == repr(table.snapshot().state)
    last, status = dict(zip(COLUMNS, samples[-1], strict=True)), table.status()
    assert last["reference_count"] / 512 == status.reference_deg
    assert last["encoder_count"] / 512 == status.encoder_deg
    assert np.degrees(last["table_angle_rad"]) == status.true_deg
    assert last["current_A"] == status.current_A
    assert last["duty"] / 1023 == status.duty
    assert status.gain_set == ("ramp", "hold")[int(last["gain_set"])]
    assert status.state == ("idle", "moving", "settling", "stalled")[int(last["motion"])]


def test_a_row_acts_before_the_step_of_its_tick() -> None:
    snapshot = Table(CONFIG).snapshot()
    motions = np.array([(5, MOVE_BY, 10 * DEG, round(20 * DEG_S), round(50 * DEG_S / 1000))])
    _, samples = run(snapshot.constants, snapshot.state, 8, motions)
    assert (samples[:, COLUMNS.index("reference_speed")] > 0.0).tolist() == [False] * 5 + [True] * 3


def test_a_move_to_and_a_move_by_of_the_same_target_are_the_same() -> None:
    snapshot = Table(CONFIG).snapshot()
    row = [12 * DEG, round(20 * DEG_S), round(50 * DEG_S / 1000)]
    by, to = (
        run(snapshot.constants, snapshot.state, 500, np.array([[0, kind, *row]]))[0] for kind in (MOVE_BY, MOVE_TO)
    )
    assert by == to
