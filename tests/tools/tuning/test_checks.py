import pytest

from emulator.config import load_config
from tools.tuning.checks import Figure, all_checks

FIGURES = [figure for check in all_checks(load_config(), seed=1) for figure in check.figures]


@pytest.mark.parametrize(
    "figure", [figure for figure in FIGURES if figure.model is not None], ids=lambda each: each.title
)
def test_the_emulator_does_what_the_linear_model_foretells(figure: Figure) -> None:
    assert figure.emulator == pytest.approx(figure.model, rel=0.2)


def test_small_moves_of_the_default_table_end_near_their_target() -> None:
    (miss,) = (figure for figure in FIGURES if figure.title.startswith("greatest distance"))
    assert miss.emulator < 0.05
