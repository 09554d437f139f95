"""Thin out a curve of many samples for a drawing, without a visible change."""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

_COLUMNS = 3000
"""Columns of a curve; more than a figure's width in pixels."""


def envelope(time_s: Array, values: Array, columns: int = _COLUMNS) -> tuple[Array, Array]:
    """Return, for each column of the drawing, the first, last, lowest and highest sample, in order of time.

    Args:
        time_s: (n,) ascending times.
        values: (n,) samples.
        columns: number of columns over the whole time.
    """
    if len(time_s) <= 4 * columns:
        return time_s, values
    share = (time_s - time_s[0]) / (time_s[-1] - time_s[0])
    column = np.minimum((share * columns).astype(np.intp), columns - 1)
    first = np.flatnonzero(np.diff(column, prepend=-1))
    last = np.append(first[1:], len(column)) - 1
    by_value = np.lexsort((values, column))  # within each column from the lowest to the highest
    kept = np.unique(np.concatenate([first, last, by_value[first], by_value[last]]))
    return time_s[kept], values[kept]
