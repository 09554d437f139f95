from itertools import pairwise

import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from tools.command_marks import grouped, mark_commands


@pytest.mark.parametrize("count", [1, 3, 12, 139, 5000])
def test_labels_neither_stack_up_nor_overlap(count: int) -> None:
    commands = [(60.0 * (index + 0.5) / count, f"P -{100 + index % 80}.25") for index in range(count)]
    figure = Figure(figsize=(10.0, 7.5), layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.subplots()
    axes.set_xlim(0.0, 60.0)

    mark_commands([axes], commands)

    figure.draw_without_rendering()
    boxes = [label.get_window_extent() for label in axes.texts]
    assert all(left.x1 < right.x0 for left, right in pairwise(boxes))
    assert all(label.get_text().count("\n") < 4 for label in axes.texts)
    assert len(axes.texts) >= min(count, 6)


@pytest.mark.parametrize("count", [1, 4, 5, 139])
def test_no_command_is_lost_without_being_counted(count: int) -> None:
    groups = grouped([(0.001 * index, f"S {index}") for index in range(count)], 60.0)

    lines = groups[0].label.splitlines()
    hidden = int(lines.pop().removeprefix("+ ")) if lines[-1].startswith("+") else 0
    assert len(groups) == 1
    assert lines == [f"S {index}" for index in range(len(lines))]
    assert len(lines) + hidden == count


def test_commands_outside_of_the_drawing_have_no_label() -> None:
    axes = Figure().subplots()
    axes.set_xlim(10.0, 20.0)

    mark_commands([axes], [(5.0, "P 1"), (15.0, "P 2"), (25.0, "P 3")])

    assert [label.get_text() for label in axes.texts] == ["P 2"]
