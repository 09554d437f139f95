from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from matplotlib.figure import Figure
from matplotlib.image import imread

from planner.map import map_plots
from planner.map.config_map import ConfigurationMap
from planner.map.map_colors import DARKEST_GRAY, colored
from planner.map.map_plots import map_figure, plot_map, plot_map_cylinder
from planner.map.map_reasons import FIRST_PAIR, reason_texts
from planner.plans.plan import make_plan
from planner.plans.plan_plots import plan_figure
from planner.plans.problem import Problem
from planner.plot_style import DPI, WIDTH_IN
from planner.reasons import Reason
from tests.planner.drawn import Drawn
from tools import paper_figures

PAIRS = tuple(f"part {i} and table" for i in range(8))


def a_map() -> ConfigurationMap:
    values = np.linspace(0.1, 1.0, 40 * 36).reshape(40, 36)
    reasons = np.zeros(values.shape, dtype=np.uint8)
    reasons[:, :6] = Reason.OUT_OF_REACH
    reasons[5, :] = Reason.JOINT_3_LIMIT
    for pair in range(8):
        reasons[10 + pair, 20 : 30 - pair] = FIRST_PAIR + pair
    values[reasons > 0] = 0.0
    return ConfigurationMap(values, reasons, metadata={"scan": "test", "reasons": reason_texts(PAIRS, [])})


def test_allowed_cells_are_gray_and_forbidden_ones_are_not() -> None:
    image, _ = colored(a_map())
    allowed = a_map().allowed.T
    spread = image.max(axis=2) - image.min(axis=2)
    assert (spread[allowed] == 0.0).all()
    assert (spread[~allowed] > 0.05).all()
    assert image[allowed].min() > DARKEST_GRAY


def test_the_legend_names_each_reason_once_with_its_share_the_most_frequent_first() -> None:
    _, legend = colored(a_map())
    shares = [entry.share for entry in legend]
    assert sum(shares) == pytest.approx((~a_map().allowed).mean())
    assert legend[0].text == "out of reach"
    assert "joint 3 limit" in [entry.text for entry in legend]
    assert len({entry.color for entry in legend}) == len(legend)
    assert legend[-1].text == "other collisions"


def test_a_map_without_reasons_is_drawn_too(tmp_path: Path) -> None:
    plot_map(ConfigurationMap(np.ones((3, 8))), tmp_path / "map.png")
    assert (tmp_path / "map.png").stat().st_size > 1000


@pytest.mark.parametrize("plot", [plot_map, plot_map_cylinder])
def test_the_same_map_is_the_same_picture_to_the_byte(plot: type, tmp_path: Path) -> None:
    for name in ("a.png", "b.png"):
        plot(a_map(), tmp_path / name)
    assert (tmp_path / "a.png").read_bytes() == (tmp_path / "b.png").read_bytes()
    assert sorted(file.name for file in tmp_path.iterdir()) == ["a.png", "b.png"]
    assert imread(tmp_path / "a.png").shape[1] in (8.0 * DPI, WIDTH_IN * DPI)


def scattered_map() -> ConfigurationMap:
    """Return a map without symmetry: different numbers of locations and angles, some dark cells."""
    rng = np.random.default_rng(4)
    return ConfigurationMap(np.where(rng.random((12, 20)) < 0.3, 0.0, rng.uniform(0.6, 1.0, (12, 20))))


def flat_map() -> Figure:
    return map_figure(scattered_map())


def map_of_a_plan() -> Figure:
    problem = Problem(scattered_map())
    return plan_figure(problem, make_plan(problem, "test", np.zeros(12), np.zeros(12), np.zeros(11)), "")


def test_a_plan_lies_on_the_map_in_the_colors_of_its_reasons() -> None:
    shown = a_map()
    problem = Problem(shown)
    figure = plan_figure(problem, make_plan(problem, "test", np.full(40, 340.0), np.zeros(40), np.zeros(39)), "")
    drawn, axes = Drawn(figure), figure.axes[0]
    image, legend = colored(shown)
    for location in range(1, 40):
        for sample in range(1, 32):
            assert drawn.color(axes, location, sample * 10.0) == pytest.approx(image[sample, location], abs=0.02)
    named = [text.get_text() for text in figure.legends[0].get_texts()]
    assert [text.rpartition(" (")[0] for text in named] == [entry.text for entry in legend]


def map_of_the_paper() -> Figure:
    figure = Figure(figsize=(6.0, 4.0))
    paper_figures._draw_map(figure.subplots(), scattered_map())  # noqa: SLF001 - the part of Fig. 6 to 9 that draws the map
    return figure


@pytest.mark.parametrize("draw", [flat_map, map_of_a_plan, map_of_the_paper])
def test_a_cell_is_drawn_at_its_location_and_angle(
    draw: Callable[[], Figure],
) -> None:
    figure, shown = draw(), scattered_map()
    drawn, axes = Drawn(figure), figure.axes[0]
    assert axes.get_xlabel() in ("scan location", "")
    assert axes.get_ylabel().startswith("table angle")
    for location in range(12):
        for sample in range(1, 20):  # the path of the plan lies at 0
            bright = drawn.color(axes, location, sample * 18.0).mean()
            assert (bright > 0.5) == bool(shown.allowed[location, sample])


def test_the_tube_shows_each_angle_in_its_row_and_each_location_in_its_column() -> None:
    image = colored(scattered_map())[0]
    for center_deg in (0.0, 180.0):
        tube = map_plots._tube(image, center_deg, 700, 260)  # noqa: SLF001 - the picture without its axes
        for offset_deg in (-72.0, -36.0, 0.0, 36.0, 72.0):
            y, z = np.sin(np.radians(offset_deg)), np.cos(np.radians(offset_deg))
            row = int((y + 1.0) / 2.0 * 260)
            sample = round((center_deg + offset_deg) / 18.0) % 20
            for location in range(12):
                # The tube is 4 radii long; its near side is drawn bulged to the left by 0.3 of the depth.
                x = 4.0 * (location + 0.5) / 12.0 - 0.3 * z
                column = int((x + 0.3) / 4.6 * 700)
                shade = 0.55 + 0.45 * z
                assert tube[row, column, :3] == pytest.approx(image[sample, location] * shade, abs=0.02)
