from dataclasses import replace

import control
import numpy as np
import pytest
from numpy.testing import assert_allclose

from emulator.config.constants import drive_constants, fixed_gains
from emulator.config.table_config import TableConfig, load_config
from emulator.plant import drive_train
from tools.emulated import Array
from tools.tuning.frequency_response import grid_z, plant_response
from tools.tuning.linear_model import Teeth, duty_gains, plant, speed_gain_deg_s
from tools.tuning.loop import closed_loop

CONFIG = load_config()


def frictionless(backlash_arcmin: float) -> TableConfig:
    return replace(
        CONFIG,
        friction=replace(CONFIG.friction, coulomb_Nm=0.0),
        table=replace(CONFIG.table, bearing_friction_Nm=0.0),
        gears=replace(CONFIG.gears, backlash_arcmin=backlash_arcmin, efficiency=1.0),  # their losses are friction too
    )


def emulated_answer(config: TableConfig, reference_deg_s: Array, load_Nm: Array) -> Array:
    """Close the firmware's loop, in real numbers, around the emulator's plant; return the speed after each tick."""
    train = drive_constants(config)
    state = drive_train.at_standstill(train, 0.0)
    proportional, integral, derivative = duty_gains(config, fixed_gains(config, config.gains.hold))
    window, tick_hz = config.control.speed_window_ticks, config.control.tick_hz
    angles_deg = [0.0] * window
    summed = last_measured = duty = buffered = 0.0
    speeds = []
    for reference, load in zip(reference_deg_s, load_Nm, strict=True):
        speeds.append(np.degrees(state.speed_rad_s) / config.gears.ratio)
        angle_deg = np.degrees(state.angle_rad) / config.gears.ratio
        measured = (angle_deg - angles_deg[-window]) * tick_hz / window
        angles_deg.append(angle_deg)
        summed += integral * (reference - measured)
        buffered, duty = (
            proportional * (reference - measured) + summed - derivative * (measured - last_measured),
            buffered,
        )
        last_measured = measured
        state = drive_train.step(train, state, duty * config.driver.supply_V, load)
    return np.array(speeds)


@pytest.mark.parametrize(("teeth", "backlash_arcmin"), [(Teeth.DRIVING, 0.0), (Teeth.FREE, 600.0)])
def test_the_step_answer_is_the_emulators_without_friction_backlash_and_quantization(
    teeth: Teeth, backlash_arcmin: float
) -> None:
    config = frictionless(backlash_arcmin)
    ticks = np.arange(300)
    reference = np.where(ticks >= 5, 2.0, 0.0)
    load = np.where((ticks >= 150) & (teeth is Teeth.DRIVING), 0.1, 0.0)

    model = control.forced_response(
        closed_loop(config, teeth, fixed_gains(config, config.gains.hold)),
        ticks / config.control.tick_hz,
        np.vstack([reference, load, np.zeros_like(load)]),
    )

    assert_allclose(model.outputs[0], emulated_answer(config, reference, load), atol=1e-6)


@pytest.mark.parametrize("teeth", Teeth)
def test_a_stack_of_plants_has_the_responses_of_each_plant_alone(teeth: Teeth) -> None:
    z = grid_z(64)
    heavy = replace(CONFIG, table=replace(CONFIG.table, inertia_kg_m2=0.6))

    stacked = plant_response([CONFIG, heavy], teeth, z)

    for row, config in enumerate((CONFIG, heavy)):
        alone = plant(config, teeth)(z)
        assert_allclose(stacked.speed_by_duty[row], alone[0, 0], rtol=1e-9)
        assert_allclose(stacked.measured_by_duty[row], alone[1, 0], rtol=1e-9, atol=1e-9)
        assert_allclose(stacked.speed_by_load[row], alone[0, 1], rtol=1e-9, atol=1e-12)
        assert_allclose(stacked.measured_by_load[row], alone[1, 1], rtol=1e-9, atol=1e-9)


def test_at_full_duty_the_table_runs_at_the_plants_gain() -> None:
    assert control.dcgain(plant(CONFIG, Teeth.DRIVING))[0, 0] == pytest.approx(speed_gain_deg_s(CONFIG))
    assert speed_gain_deg_s(CONFIG) == pytest.approx(61.0, abs=0.1)  # the no-load speed of the datasheet, geared down
