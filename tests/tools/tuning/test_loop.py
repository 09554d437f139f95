from dataclasses import replace
from random import Random

import control
import numpy as np
import pytest
from numpy.testing import assert_allclose

from emulator.config.table_config import ConfigError, GainsConfig, TableConfig, load_config
from tests.tools.tuning import loop_oracle
from tools.tuning import Teeth, closed_loop, gains_config, open_loop, plant, registers, regulator

CONFIG = load_config()
SETS = {"ramp": CONFIG.gains.ramp, "hold": CONFIG.gains.hold}


def random_table(seed: int) -> tuple[TableConfig, GainsConfig]:
    """Return a table with another controller, encoder, motor and load, and gains of about the default bandwidth."""
    chance = Random(seed)  # noqa: S311  # no secret depends on it
    tick_hz, window = chance.choice([200, 500, 1000, 4000]), chance.choice([1, 2, 8, 33, 64])
    config = replace(
        CONFIG,
        control=replace(CONFIG.control, tick_hz=tick_hz, speed_window_ticks=window),
        encoder=replace(CONFIG.encoder, lines=chance.choice([16, 96, 500])),
        motor=replace(CONFIG.motor, resistance_ohm=CONFIG.motor.resistance_ohm * chance.uniform(0.5, 2.0)),
        table=replace(CONFIG.table, inertia_kg_m2=CONFIG.table.inertia_kg_m2 * chance.uniform(0.2, 10.0)),
    )
    gains = GainsConfig(chance.uniform(0.01, 0.03), chance.uniform(0.01, 0.05), chance.uniform(0.0, 0.002))
    return config, gains_config(config, registers(config, gains))


@pytest.mark.parametrize("seed", range(12))
@pytest.mark.parametrize("teeth", Teeth)
def test_the_open_loop_is_that_of_the_differential_equations(seed: int, teeth: Teeth) -> None:
    config, gains = random_table(seed)
    hz = np.geomspace(1e-3, 0.45, 60) * config.control.tick_hz

    found = open_loop(config, teeth, gains)(np.exp(2j * np.pi * hz / config.control.tick_hz))

    expected = loop_oracle.loop(config, teeth, gains, hz).open
    assert np.max(np.abs(found - expected) / (1e-3 + np.abs(expected))) < 1e-6


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("teeth", Teeth)
def test_the_closed_loop_is_that_of_the_differential_equations(seed: int, teeth: Teeth) -> None:
    config, gains = random_table(seed)
    hz = np.geomspace(1e-3, 0.45, 60) * config.control.tick_hz
    system = closed_loop(config, teeth, gains)
    expected = loop_oracle.loop(config, teeth, gains, hz)

    for output, source, response in (
        ("speed_deg_s", "reference_deg_s", expected.speed_by_reference),
        ("speed_deg_s", "load_Nm", expected.speed_by_load),
        ("duty", "encoder_error_deg", expected.duty_by_encoder),
    ):
        found = system[output, source](np.exp(2j * np.pi * hz / config.control.tick_hz))
        assert_allclose(found, response, rtol=1e-3, atol=1e-3 * np.abs(response).max() + 1e-12, err_msg=output)


@pytest.mark.parametrize("teeth", Teeth)
@pytest.mark.parametrize("name", SETS)
def test_python_controls_margins_are_those_of_the_differential_equations(name: str, teeth: Teeth) -> None:
    hz = np.arange(0.2, 500.0, 0.2)
    gains = gains_config(CONFIG, registers(CONFIG, SETS[name]))

    gain, phase_deg, distance, *_ = control.stability_margins(open_loop(CONFIG, teeth, gains), method="frd")

    expected = loop_oracle.margins(loop_oracle.loop(CONFIG, teeth, gains, hz).open)
    assert 20.0 * np.log10(gain) == pytest.approx(expected.gain_margin_db, abs=0.05)
    assert phase_deg == pytest.approx(expected.phase_margin_deg, abs=0.1)
    assert 1.0 / distance == pytest.approx(expected.sensitivity_peak, rel=1e-3)


@pytest.mark.parametrize("teeth", Teeth)
@pytest.mark.parametrize("name", SETS)
def test_without_the_pwms_tick_a_margin_would_be_several_degrees_better(name: str, teeth: Teeth) -> None:
    hz = np.arange(0.2, 500.0, 0.2)
    margins = [
        loop_oracle.margins(loop_oracle.loop(CONFIG, teeth, SETS[name], hz, delay_ticks).open).phase_margin_deg
        for delay_ticks in (0, 1)
    ]

    _, found_deg, *_ = control.stability_margins(open_loop(CONFIG, teeth, SETS[name]), method="frd")

    assert found_deg == pytest.approx(margins[1], abs=0.1)
    assert 4.5 < margins[0] - margins[1] < 8.5  # docs/tuning.md: 5 to 8 deg


@pytest.mark.parametrize("teeth", Teeth)
def test_the_root_locus_passes_the_closed_loops_poles(teeth: Teeth) -> None:
    locus = control.root_locus_map(open_loop(CONFIG, teeth, CONFIG.gains.hold), gains=[1.0])

    poles = closed_loop(CONFIG, teeth, CONFIG.gains.hold).poles()
    assert_allclose(sorted(np.abs(locus.loci[0])), sorted(np.abs(poles)), atol=1e-6)


@pytest.mark.parametrize("seed", [0, 1, 2, 4, 5, 6, 7, 8, 9, 11])  # those of which the loop is stable
def test_python_controls_norm_is_the_noise_at_the_pwm(seed: int) -> None:
    """Parseval: the variance is the mean of the squared response over all frequencies up to half the tick rate."""
    config, gains = random_table(seed)
    system = closed_loop(config, Teeth.DRIVING, gains)
    assert np.abs(system.poles()).max() < 1.0
    hz = (np.arange(4000) + 0.5) / 8000.0 * config.control.tick_hz

    found = control.norm(system["duty", "encoder_error_deg"], 2)

    responses = loop_oracle.loop(config, Teeth.DRIVING, gains, hz).duty_by_encoder
    assert found == pytest.approx(np.sqrt(np.mean(np.abs(responses) ** 2)), rel=1e-3)


def test_signals_and_systems_have_names_with_units() -> None:
    systems = (
        plant(CONFIG, Teeth.FREE),
        regulator(CONFIG, CONFIG.gains.ramp),
        open_loop(CONFIG, Teeth.DRIVING, CONFIG.gains.ramp),
        closed_loop(CONFIG, Teeth.OVERHAULING, CONFIG.gains.ramp),
    )

    assert [(each.name, each.input_labels, each.output_labels, each.dt) for each in systems] == [
        ("plant_free", ["duty", "load_Nm", "encoder_error_deg"], ["speed_deg_s", "measured_deg_s"], 1e-3),
        ("regulator", ["reference_deg_s", "measured_deg_s"], ["duty"], 1e-3),
        ("open_loop_driving", ["error_deg_s"], ["measured_deg_s"], 1e-3),
        (
            "closed_loop_overhauling",
            ["reference_deg_s", "load_Nm", "encoder_error_deg"],
            ["speed_deg_s", "measured_deg_s", "duty"],
            1e-3,
        ),
    ]


@pytest.mark.parametrize("seed", range(12))
def test_gains_in_engineering_units_are_those_of_the_registers(seed: int) -> None:
    """By hand: counts a window to deg/s, duty to PWM steps, seconds to ticks; 12, 16 and 12 fraction bits."""
    config, gains = random_table(seed)
    window_s = config.control.speed_window_ticks / config.control.tick_hz
    count_deg_s = 360.0 / (4.0 * config.encoder.lines * config.gears.ratio) / window_s
    steps = gains.proportional_duty_s_deg * count_deg_s * (2**config.driver.pwm_bits - 1)

    held = registers(config, gains)

    assert held.proportional == round(steps * 4096)
    assert held.integral == round(steps / gains.integral_time_s / config.control.tick_hz * 65536)
    assert held.derivative == round(steps * gains.derivative_time_s * config.control.tick_hz * 4096)
    assert registers(config, gains_config(config, held)) == held


@pytest.mark.parametrize(
    ("gains", "complaint"),
    [
        (GainsConfig(float("nan"), 0.01, 0.001), "gains: proportional_duty_s_deg is nan; it must be a finite number"),
        (
            GainsConfig(-0.01, 0.01, 0.001),
            "proportional_duty_s_deg is -0.01; it must be a finite number at least 0",
        ),
        (GainsConfig(0.01, 0.0, 0.001), "integral_time_s is 0.0; it must be a finite number at least 1e-06"),
        (GainsConfig(0.01, 0.01, -1.0), "derivative_time_s is -1.0; it must be a finite number at least 0"),
        (GainsConfig(0.0, 0.01, 0.0), "does not fit the firmware"),
    ],
)
def test_gains_that_the_firmware_cannot_hold_are_refused(gains: GainsConfig, complaint: str) -> None:
    with pytest.raises(ConfigError, match=complaint):
        open_loop(CONFIG, Teeth.DRIVING, gains)


def test_an_unknown_state_of_the_backlash_is_refused() -> None:
    assert plant(CONFIG, Teeth("free")).name == "plant_free"
    with pytest.raises(ValueError, match="'loose' is not a valid Teeth"):
        plant(CONFIG, "loose")  # type: ignore[arg-type]  # what a program without types may pass
