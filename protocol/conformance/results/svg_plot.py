"""Small SVG plots, without a library."""

import math
from collections.abc import Sequence
from html import escape
from typing import NamedTuple

Points = Sequence[tuple[float, float]]

_WIDTH, _PANEL, _LEFT, _RIGHT, _GAP, _BOTTOM = 760, 150, 58, 12, 16, 34


class Panel(NamedTuple):
    """One pair of axes: a line of expected values, and dots of measured values."""

    label: str
    line: Points
    dots: Points


def plot(panels: Sequence[Panel], x_label: str, alt: str) -> str:
    """Return panels one below the other with the same x axis; `alt` is the text alternative."""
    x_low, x_high = _extent([x for panel in panels for x, _ in (*panel.line, *panel.dots)])
    height = len(panels) * (_PANEL + _GAP) + _BOTTOM
    parts = [f'<svg class="plot" viewBox="0 0 {_WIDTH} {height}" role="img" aria-label="{escape(alt)}">']
    for index, panel in enumerate(panels):
        top = _GAP + index * (_PANEL + _GAP)
        parts += _panel(panel, top, x_low, x_high)
    base = len(panels) * (_PANEL + _GAP)
    for value in _ticks(x_low, x_high, 8):
        x = _scaled(value, x_low, x_high, _LEFT, _WIDTH - _RIGHT)
        parts.append(f'<text class="tick" x="{x:.1f}" y="{base + 14}" text-anchor="middle">{_short(value)}</text>')
    middle = (_LEFT + _WIDTH - _RIGHT) / 2
    parts.append(f'<text class="label" x="{middle}" y="{base + 30}" text-anchor="middle">{x_label}</text></svg>')
    return "".join(parts)


def range_bar(value: float, least: float | None, most: float | None, verdict: str) -> str:
    """Return a bar for a range, with a mark at a value inside or outside of it."""
    low = least if least is not None else min(0.0, value) if most is None or most >= 0 else 2 * most
    high = most if most is not None else 2 * low if low > 0 else max(1.0, 2 * value)
    share = min(max((value - low) / (high - low) if high > low else 0.5, -0.1), 1.1)
    return (
        f'<svg class="bar" viewBox="0 0 130 12" role="img" aria-label="{value:.5g} within {low:.6g} to {high:.6g}">'
        '<rect class="range" x="15" y="4" width="100" height="4" rx="2"/>'
        f'<circle class="{verdict}" cx="{15 + 100 * share:.1f}" cy="6" r="4"/></svg>'
    )


def _panel(panel: Panel, top: float, x_low: float, x_high: float) -> list[str]:
    y_low, y_high = _extent([y for _, y in (*panel.line, *panel.dots)])
    bottom, right = top + _PANEL, _WIDTH - _RIGHT

    def at(x: float, y: float) -> tuple[float, float]:
        return _scaled(x, x_low, x_high, _LEFT, right), _scaled(y, y_low, y_high, bottom - 4, top + 4)

    parts = [f'<rect class="frame" x="{_LEFT}" y="{top}" width="{right - _LEFT}" height="{_PANEL}"/>']
    for value in _ticks(y_low, y_high, 5):
        y = at(x_low, value)[1]
        parts.append(f'<line class="grid" x1="{_LEFT}" y1="{y:.1f}" x2="{right}" y2="{y:.1f}"/>')
        parts.append(f'<text class="tick" x="{_LEFT - 6}" y="{y + 4:.1f}" text-anchor="end">{_short(value)}</text>')
    for value in _ticks(x_low, x_high, 8):
        x = at(value, y_low)[0]
        parts.append(f'<line class="grid" x1="{x:.1f}" y1="{top}" x2="{x:.1f}" y2="{bottom}"/>')
    path = " ".join(f"{x:.1f},{y:.1f}" for x, y in (at(*point) for point in panel.line))
    parts.append(f'<polyline class="expected" points="{path}"/>')
    dots = "".join(f"M{x:.1f} {y:.1f}h0" for x, y in (at(*point) for point in panel.dots))
    parts.append(f'<path class="seen" d="{dots}"/>')
    middle = (top + bottom) / 2
    parts.append(
        f'<text class="label" x="13" y="{middle}" transform="rotate(-90 13 {middle})" text-anchor="middle">'
        f"{panel.label}</text>"
    )
    return parts


def _extent(values: Sequence[float]) -> tuple[float, float]:
    low, high = min(values, default=0.0), max(values, default=1.0)
    return (low, high) if high - low > 1e-6 else (low - 0.5, high + 0.5)


def _scaled(value: float, low: float, high: float, first: float, last: float) -> float:
    return first + (value - low) / (high - low) * (last - first)


def _ticks(low: float, high: float, most: int) -> list[float]:
    """Return at most `most` round values within an extent."""
    rough = (high - low) / most
    power = 10.0 ** math.floor(math.log10(rough))
    step = next(factor * power for factor in (1, 2, 5, 10) if factor * power >= rough)
    return [index * step for index in range(math.ceil(low / step), math.floor(high / step) + 1)]


def _short(value: float) -> str:
    return f"{value:.6g}" if abs(value) > 1e-9 else "0"
