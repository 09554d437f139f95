"""The examples of docs/tuning.md, "In Python": run, and compared with a loop that is computed from scratch."""

import doctest
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from emulator.config.table_config import load_config
from tests.tools.tuning import loop_oracle
from tools.tuning import Teeth

PAGE = Path(__file__).parents[3] / "docs" / "tuning.md"
SECTION = PAGE.read_text(encoding="utf-8").split("## In Python\n")[1].split("\n## ")[0]
CONFIG = load_config()
TICKS = 4096
GRID_HZ = np.arange(1, TICKS // 2 + 1) * (CONFIG.control.tick_hz / TICKS)


@pytest.fixture(scope="module")
def names(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    """Run the section as one session; return its names, and the folder in which it wrote its plots."""
    folder = tmp_path_factory.mktemp("session")
    session = doctest.DocTestParser().get_doctest(SECTION, {}, "In Python", str(PAGE), 0)
    runner = doctest.DocTestRunner(verbose=False)
    report: list[str] = []
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        runner.run(session, out=report.append, clear_globs=False)
    assert not runner.failures, "".join(report)
    return {**session.globs, "folder": folder}


def test_the_margins_are_those_of_the_differential_equations(names: dict[str, Any]) -> None:
    expected = loop_oracle.margins(loop_oracle.loop(CONFIG, Teeth.FREE, names["gains"], GRID_HZ).open)

    assert 20.0 * np.log10(names["gain_margin"]) == pytest.approx(expected.gain_margin_db, abs=0.05)
    assert names["phase_margin_deg"] == pytest.approx(expected.phase_margin_deg, abs=0.05)
    assert 1.0 / names["distance"] == pytest.approx(expected.sensitivity_peak, abs=0.005)


def test_the_poles_are_zeros_of_one_plus_the_loop(names: dict[str, Any]) -> None:
    """Outside the unit circle's grid: a pole z belongs to the frequency log(z) / (2 pi j T), which may be complex."""
    slow = names["poles"][np.abs(names["poles"]) > 0.5]
    assert len(slow) >= 3

    hz = np.log(slow) * CONFIG.control.tick_hz / 2j / np.pi
    opened = loop_oracle.loop(CONFIG, Teeth.FREE, names["gains"], hz).open

    assert np.abs(1.0 + opened).max() < 1e-3


def test_the_steps_are_those_of_the_differential_equations(names: dict[str, Any]) -> None:
    responses = loop_oracle.loop(CONFIG, Teeth.DRIVING, names["gains"], GRID_HZ)
    speed = loop_oracle.step_response(responses.speed_by_reference, 1.0)
    lost = loop_oracle.step_response(responses.speed_by_load, 0.0)

    assert np.max(np.abs(names["step"].outputs - speed[: names["step"].outputs.size])) < 2e-3
    assert np.max(np.abs(names["load"].outputs - lost[: names["load"].outputs.size])) < 2e-3
    assert names["peak"].model == pytest.approx(-0.29 * lost.min(), rel=0.01)


def test_the_noise_is_that_of_the_differential_equations(names: dict[str, Any]) -> None:
    by_encoder = loop_oracle.loop(CONFIG, Teeth.DRIVING, names["gains"], GRID_HZ).duty_by_encoder
    count_deg = 360.0 / (4.0 * CONFIG.encoder.lines * CONFIG.gears.ratio)

    expected = count_deg / np.sqrt(12.0) * np.sqrt(np.mean(np.abs(by_encoder) ** 2))

    assert names["noise"] == pytest.approx(expected, rel=0.01)


def test_the_emulator_agrees_with_the_loop_of_own_gains(names: dict[str, Any]) -> None:
    peak = names["peak"]

    assert peak.emulator == pytest.approx(peak.model, rel=0.2)


def test_the_page_lists_the_keys_of_all_figures(names: dict[str, Any]) -> None:
    assert re.findall(r"^\| `(\w+)` \|", SECTION, re.MULTILINE) == list(names["checks"].figures)


def test_the_plots_are_written(names: dict[str, Any]) -> None:
    assert {path.name for path in names["folder"].iterdir()} == {"bode.svg", "nyquist.svg", "root-locus.svg"}
