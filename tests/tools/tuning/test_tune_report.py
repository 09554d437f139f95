import re
from itertools import pairwise

import pytest

from emulator.config.table_config import load_config
from tools.bounds import Limits
from tools.tuning.checks import Difference
from tools.tuning.tune_plots import plots
from tools.tuning.tune_report import tune_report
from tools.tuning.tuned_table import Terms, Tuning, tune


@pytest.fixture(scope="module")
def tuning() -> Tuning:
    return tune(load_config(), Terms(Limits(), plants=8, spread=0.2, seed=0))


def cells(html: str, first: str) -> list[str]:
    """Return the texts of the row that begins with this cell."""
    row = re.search(rf"<tr><td>{re.escape(first)}</td>(.*?)</tr>", html)
    assert row, first
    return [re.sub("<.*?>", "", cell) for cell in re.findall(r"<td.*?</td>", row[1])]


def test_the_report_says_how_far_each_answer_is_from_the_model(tuning: Tuning) -> None:
    html = tune_report(tuning, plots(tuning))

    for before, after in tuning.checks:
        for former, figure in zip(before.figures, after.figures, strict=True):
            *_, change, model, difference = cells(html, f"{figure.title} ({figure.unit})")
            if former.emulator > 0.0:
                percent = 100.0 * (figure.emulator / former.emulator - 1.0)
                assert change == (f"{percent:+.0f} %" if abs(percent) > 0.5 else "0 %")
            if figure.model is None:
                assert model == difference == ""
            else:
                share = 100.0 * (figure.emulator / figure.model - 1.0)
                sign = "more" if share > 0 else "less"
                assert difference in (f"{abs(share):.0f} % {sign}", "0 %")


def test_the_report_shows_what_is_not_bounded_and_compares_with_other_bounds_and_rules(tuning: Tuning) -> None:
    html = tune_report(tuning, plots(tuning))
    ramp = tuning.sets["ramp"].design.figures

    former = tuning.sets["ramp"].before_figures
    *_, overshoot, change = cells(html, "overshoot after a step")
    assert overshoot == f"{100 * ramp.overshoot[0]:.3g} %"
    assert change == f"{100 * (ramp.overshoot[0] / former.overshoot[0] - 1.0):+.0f} %"
    asked = cells(html, "0.62")
    assert asked[-1] == "asked"
    lags = [float(cells(html, f"{100 * trade.noise_duty:.3g}")[0]) for trade in tuning.trades if trade.feasible]
    assert len(lags) > 2
    assert all(after <= 1.01 * before for before, after in pairwise(lags))  # more noise, less lag
    assert lags[-1] < 0.6 * lags[0]
    for name in ("SIMC PI", "AMIGO PI", "AMIGO PID", "ramp set", "constant-speed set"):
        assert len(cells(html, name)) >= 9


def test_the_report_names_the_binding_bounds_and_repeats(tuning: Tuning) -> None:
    html = tune_report(tuning, plots(tuning))

    assert "Binding for the ramp set: Ms and noise at the PWM." in html
    assert html == tune_report(tuning, plots(tuning))


def test_a_difference_is_explained_in_the_report(tuning: Tuning) -> None:
    ramp = tuning.checks[0][1].figures[0]
    wrong = ramp._replace(model=2.0 * ramp.emulator)

    explained = Difference(wrong, {"stiction": 0.125, "backlash": 0.25})

    html = tune_report(tuning._replace(differences=(explained,)), plots(tuning))

    assert "it would be 0.125 without stiction, 0.25 without backlash" in html
