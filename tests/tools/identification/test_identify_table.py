from pathlib import Path

import pytest

import emulator  # noqa: F401  # teaches pyserial the port emulator://
from emulator.config.table_config import TableConfig, load_config
from protocol.client import TableClient
from tools.bench.identify_tables import random_plant, write_constants
from tools.emulated import Motion, emulate
from tools.identification.constants import Constant, coulomb_Nm
from tools.identification.excitation import excitation
from tools.identification.fit_checks import check_fit
from tools.identification.identify_table import Identified, identify
from tools.identification.recorder import record
from tools.identification.recording import DriveRecording, WireRecording
from tools.identification.recording_checks import check_recording
from tools.tuning.linear_model import Teeth, speed_gain_deg_s, time_constant_s


def assert_within_bounds(found: Identified, truth: TableConfig) -> None:
    check_fit(found)
    assert speed_gain_deg_s(found.config) == pytest.approx(speed_gain_deg_s(truth), rel=0.05)
    assert time_constant_s(found.config, Teeth.DRIVING) == pytest.approx(
        time_constant_s(truth, Teeth.DRIVING), rel=0.05
    )
    assert coulomb_Nm(found.config) == pytest.approx(coulomb_Nm(truth), rel=0.15)
    assert found.config.gears.backlash_arcmin == pytest.approx(truth.gears.backlash_arcmin, rel=0.2)


def test_a_minute_over_the_wire_tells_the_constants_of_a_table_that_it_has_not_seen(
    assumed: TableConfig, recording: WireRecording, unseen: Path
) -> None:
    found = identify(assumed, recording)

    assert_within_bounds(found, load_config(unseen))
    identifiable = {constant.name for constant in found.constants if constant.identifiable}
    assert {"gain", "time constant", "Coulomb friction", "backlash"} <= identifiable
    assert not {"viscous friction", "delay"} & identifiable  # the line delays commands and readings alike


def test_a_long_ridge_is_followed_to_its_top(assumed: TableConfig, tmp_path: Path) -> None:
    plant = write_constants(
        tmp_path / "table.toml", random_plant(23)
    )  # climbing by slopes alone stops there with a third of the friction missing
    with TableClient.open(f"emulator://?config={plant}&seed=23") as client:
        recorded = record(client, excitation(60.0, 40.0, 100.0, seed=0), speed_deg_s=40.0, baud=9600)

    assert_within_bounds(identify(assumed, recorded), load_config(plant))


def test_so_does_a_minute_that_a_busy_computer_recorded(
    assumed: TableConfig, unhurried_recording: WireRecording, unseen: Path
) -> None:
    check_recording(assumed, unhurried_recording)

    assert_within_bounds(identify(assumed, unhurried_recording), load_config(unseen))


def drive_recording(truth: TableConfig, reversals: int) -> DriveRecording:
    """Duty and encoder of a table that turns back and forth, fast and slowly."""
    speeds = (40.0, 2.0, 20.0, 5.0)
    motions = [
        Motion(0.1 + 0.6 * turn, 1000.0 * (-1.0) ** turn, speeds[turn // 4 % len(speeds)], 100.0)
        for turn in range(reversals)
    ]
    answer = emulate(truth, motions, 0.1 + 0.6 * reversals, seed=5)
    return DriveRecording(answer.time_s, answer.duty, answer.encoder_deg)


def test_a_drives_duty_tells_the_constants_more_sharply(assumed: TableConfig, unseen: Path) -> None:
    truth = load_config(unseen)

    found = identify(assumed, drive_recording(truth, 32))

    check_fit(found)
    constants: dict[str, Constant] = {constant.name: constant for constant in found.constants}
    assert constants["gain"].value == pytest.approx(speed_gain_deg_s(truth), rel=0.02)
    assert constants["time constant"].value == pytest.approx(1e3 * time_constant_s(truth, Teeth.DRIVING), rel=0.03)
    assert constants["Coulomb friction"].value == pytest.approx(1e3 * coulomb_Nm(truth), rel=0.05)
    assert constants["backlash"].value == pytest.approx(truth.gears.backlash_arcmin, rel=0.1)
    assert constants["delay"].value == pytest.approx(1.0, abs=0.25)  # the PWM's buffer
    assert constants["delay"].identifiable
