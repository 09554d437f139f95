"""The commands of a trace, and their marks in a drawing, with as many labels as are legible."""

from typing import NamedTuple

from matplotlib.axes import Axes

from emulator.trace import Trace
from protocol import LineBuffer

_MOTION_VERBS = "PRSA"
_LABEL_POINTS = 8.0
_LABEL_SHARE = 0.085
"""Width of a label, as a share of the drawn time: later commands within it are listed below the first one."""
_MOST_TICKS = 400
"""More ticks than this merge into one bar."""
_MOST_LINES = 4
_LONGEST_LINE = 10


class CommandGroup(NamedTuple):
    """Commands that share one label, at the time of the first one."""

    time_s: float
    texts: list[str]

    @property
    def label(self) -> str:
        """The commands, one per line; of many commands, the first ones and the number of the others."""
        shown = self.texts if len(self.texts) <= _MOST_LINES else self.texts[: _MOST_LINES - 1]
        lines = [text if len(text) <= _LONGEST_LINE else f"{text[: _LONGEST_LINE - 1]}…" for text in shown]
        hidden = len(self.texts) - len(shown)
        return "\n".join([*lines, f"+ {hidden}"] if hidden else lines)


def commands_of(trace: Trace) -> list[tuple[float, str]]:
    """Return the lines that change the motion, each with the time in seconds at which its CR was received."""
    lines = LineBuffer()
    return [
        (float(time_s), text)
        for time_s, data in zip(trace.time_s, trace.received, strict=True)
        for line in lines.feed(data)
        if isinstance(line, bytes) and (text := line.decode("ascii").strip())[0] in _MOTION_VERBS
    ]


def grouped(commands: list[tuple[float, str]], duration_s: float) -> list[CommandGroup]:
    """Return the commands in groups whose labels fit side by side in a drawing of a duration."""
    groups: list[CommandGroup] = []
    for time_s, text in commands:
        if groups and time_s - groups[-1].time_s < _LABEL_SHARE * duration_s:
            groups[-1].texts.append(text)
        else:
            groups.append(CommandGroup(time_s, [text]))
    return groups


def mark_commands(axes: list[Axes], commands: list[tuple[float, str]]) -> None:
    """Draw a tick for each command, unless there are too many, and a label and a line for each group."""
    begin_s, end_s = axes[0].get_xlim()
    seen = [(time_s, text) for time_s, text in commands if begin_s <= time_s <= end_s]
    if len(seen) <= _MOST_TICKS:
        ticks = axes[0].get_xaxis_transform()
        axes[0].plot([time_s for time_s, _ in seen], [1.0] * len(seen), "|k", transform=ticks, clip_on=False)
    for group in grouped(seen, end_s - begin_s):
        for each in axes:
            each.axvline(group.time_s, color="black", linewidth=0.6, alpha=0.5, zorder=0.5)
        axes[0].annotate(
            group.label,
            (group.time_s, 1.0),
            xycoords=("data", "axes fraction"),
            xytext=(0, 5),
            textcoords="offset points",
            fontsize=_LABEL_POINTS,
            va="bottom",
            ha="left",
        )
