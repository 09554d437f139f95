from dataclasses import replace

import numpy as np
import pytest

from emulator.config.table_config import TableConfig, load_config
from tools.emulated import Array
from tools.identification.errors import RecordingError
from tools.identification.estimation import Estimate, Half
from tools.identification.fit_checks import check_fit, motor_at_odds
from tools.identification.identify_table import Identified
from tools.identification.parameters import PARAMETERS

_TIME_S = np.linspace(0.0, 60.0, 4000)


def half(**factors: float) -> Half:
    """The result of one half with some constants larger by a factor, each known to 2 %."""
    vector = np.array([parameter.log_of(load_config()) for parameter in PARAMETERS])
    for index, parameter in enumerate(PARAMETERS):
        vector[index] += np.log(factors.get(parameter.key, 1.0))
    return Half(vector, 0.02**2 * np.eye(len(vector)))


def fit(config: TableConfig, unexplained_deg: Array, halves: tuple[Half, Half] | None = None) -> Identified:
    nothing = np.zeros(len(_TIME_S))
    estimate = Estimate(np.empty(0), np.empty((0, 0)), halves or (half(), half()), 0.0, 0.0, np.empty(0))
    return Identified(config, (), estimate, _TIME_S, nothing, nothing, unexplained_deg)


def test_a_fit_within_rounding_passes() -> None:
    check_fit(fit(load_config(), np.random.default_rng(1).normal(0.0, 5e-5, len(_TIME_S))))


def test_a_burst_that_the_model_does_not_explain_is_named() -> None:
    unexplained = np.where((_TIME_S > 30.5) & (_TIME_S < 33.5), 0.05, 0.0)

    with pytest.raises(RecordingError, match=r"0\.011 deg rms .* most of them from 30 to 34 s"):
        check_fit(fit(load_config(), unexplained))


def test_errors_everywhere_are_named_so() -> None:
    with pytest.raises(RecordingError, match="all over it"):
        check_fit(fit(load_config(), np.random.default_rng(1).normal(0.0, 0.003, len(_TIME_S))))


@pytest.mark.parametrize(
    ("key", "name"),
    [
        ("inertia_kg_m2", "time constant"),
        ("coulomb_Nm", "Coulomb friction as duty"),
        ("backlash_arcmin", "backlash"),
        ("torque_constant_Nm_A", "gain"),
    ],
)
def test_halves_that_disagree_are_named(key: str, name: str) -> None:
    agreeing = fit(load_config(), np.zeros(len(_TIME_S)), (half(), half(**{key: 1.02})))
    disagreeing = fit(load_config(), np.zeros(len(_TIME_S)), (half(), half(**{key: 1.5})))

    check_fit(agreeing)
    with pytest.raises(RecordingError, match=f"the halves of the recording disagree: {name} "):
        check_fit(disagreeing)


def motor(constant_Nm_A: float) -> TableConfig:
    usual = load_config()
    return replace(usual, motor=replace(usual.motor, torque_constant_Nm_A=constant_Nm_A))


@pytest.mark.parametrize("factor", [0.5, 0.9, 1.1, 2.0])
def test_a_motor_that_is_not_the_configured_one_is_named_with_its_no_load_speed(factor: float) -> None:
    odds = motor_at_odds(fit(motor(factor * 0.0234), np.zeros(len(_TIME_S))), load_config())

    assert f"{factor * 23.4:.3g} mNm/A" in odds
    assert f"{12.0 / (factor * 0.0234) * 30.0 / np.pi:.0f} rpm" in odds
    assert "4897 rpm" in odds


@pytest.mark.parametrize("factor", [0.95, 1.0, 1.05])
def test_a_motor_within_its_datasheet_is_not(factor: float) -> None:
    assert motor_at_odds(fit(motor(factor * 0.0234), np.zeros(len(_TIME_S))), load_config()) == ""
