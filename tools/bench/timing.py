"""Common functions for timing in the benchmarks."""

import time
from collections.abc import Callable, Sequence
from typing import TextIO


def median_s(action: Callable[[], object], runs: int = 5) -> float:
    """Return the median wall time of `action` over some runs, after one that is not counted."""
    action()
    durations = []
    for _ in range(runs):
        start = time.perf_counter()
        action()
        durations.append(time.perf_counter() - start)
    return sorted(durations)[runs // 2]


def percentile(values: Sequence[float], share: float) -> float:
    """Return the value below which a share (0..1) of the values is."""
    ordered = sorted(values)
    return ordered[min(int(share * len(ordered)), len(ordered) - 1)]


def print_table(stream: TextIO, title: str, header: Sequence[str], rows: Sequence[Sequence[str]]) -> None:
    """Print a titled table, first column to the left, the others to the right."""
    widths = [max(len(row[column]) for row in (header, *rows)) for column in range(len(header))]
    print(f"\n{title}", file=stream)
    for row in (header, *rows):
        print_row(stream, row, widths)


def print_row(stream: TextIO, row: Sequence[str], widths: Sequence[int]) -> None:
    """Print a row of a table with given widths, without buffering."""
    cells = (
        cell.rjust(width) if column else cell.ljust(width)
        for column, (cell, width) in enumerate(zip(row, widths, strict=True))
    )
    print("  " + "  ".join(cells), file=stream, flush=True)
