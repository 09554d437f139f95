"""The color of a figure at a place of its axes, read back from its pixels."""

from io import BytesIO

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.image import imread

from planner.arrays import FloatArray


class Drawn:
    """A figure as pixels."""

    def __init__(self, figure: Figure) -> None:
        """Draw it."""
        FigureCanvasAgg(figure)
        file = BytesIO()
        figure.savefig(file, format="png", dpi="figure")
        self._pixels = np.asarray(imread(BytesIO(file.getvalue())), dtype=np.float64)[:, :, :3]

    def color(self, axes: Axes, x: float, y: float) -> FloatArray:
        """Return the color `(3,)` at a place in the units of the axes."""
        column, above = axes.transData.transform((x, y))
        return np.asarray(self._pixels[len(self._pixels) - 1 - int(above), int(column)])
