from pathlib import Path

import numpy as np
import pytest
from matplotlib.image import imread

from planner.map.config_map import ConfigurationMap
from planner.map.map_colours import DARKEST_GRAY, coloured
from planner.map.map_plots import plot_map, plot_map_cylinder
from planner.map.map_reasons import FIRST_PAIR, reason_texts
from planner.reasons import Reason

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
    image, _ = coloured(a_map())
    allowed = a_map().allowed.T
    spread = image.max(axis=2) - image.min(axis=2)
    assert (spread[allowed] == 0.0).all()
    assert (spread[~allowed] > 0.05).all()
    assert image[allowed].min() > DARKEST_GRAY


def test_the_legend_names_each_reason_once_with_its_share_the_most_frequent_first() -> None:
    _, legend = coloured(a_map())
    shares = [entry.share for entry in legend]
    assert sum(shares) == pytest.approx((~a_map().allowed).mean())
    assert legend[0].text == "out of reach"
    assert "joint 3 limit" in [entry.text for entry in legend]
    assert len({entry.colour for entry in legend}) == len(legend)
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
    assert imread(tmp_path / "a.png").shape[1] == 960
