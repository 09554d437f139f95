"""The cost and the pauses of tracked scans over the number of columns in view, as one picture."""

from collections.abc import Mapping, Sequence
from pathlib import Path

from planner.defaults import RECEDING
from planner.plot_style import AMBER, BLUE, GREEN, LIMIT, VERMILION, new_figure, save_picture, styled

_COLORS = (BLUE, VERMILION, GREEN, AMBER)


@styled()
def plot_views(views: Sequence[int], ratios: Mapping[str, Sequence[tuple[float, int]]], file: Path) -> None:
    """Write the picture, which appears when it is whole.

    Args:
        views: columns in view.
        ratios: by scan and planner, for each view the cost over that with full knowledge, and the number of pauses.
        file: where to write.
    """
    figure = new_figure(3.6)
    axes = dict(zip((True, False), figure.subplots(1, 2), strict=True))
    scans = sorted({name.partition(", ")[0] for name in ratios})
    for name, values in ratios.items():
        scan, _, planner = name.partition(", ")
        panel, color = axes[planner == RECEDING], _COLORS[scans.index(scan) % len(_COLORS)]
        panel.plot(views, [ratio for ratio, _ in values], "o-", color=color, markersize=4, label=scan)
        for view, (ratio, pauses) in zip(views, values, strict=True):
            if pauses:
                panel.annotate(f"{pauses} pause(s)", (view, ratio), xytext=(6, 0), textcoords="offset points")
        panel.set_title(planner, loc="left")
    for panel in axes.values():
        panel.axhline(1.0, **LIMIT)
        panel.set(xscale="log", xlabel="columns in view", ylabel="cost / cost with full knowledge")
        panel.set_xticks(views, [str(view) for view in views])
        panel.minorticks_off()
        panel.legend()
    save_picture(figure, file)
