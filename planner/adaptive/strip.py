"""A strip: one short sweep of the probe over the workpiece, from which a session of adaptive scanning is made."""

from dataclasses import dataclass, replace

import numpy as np

from planner.arrays import FloatArray
from planner.cell.scan_path import ScanPath


@dataclass(frozen=True, eq=False)
class Strip:
    """A sweep of the probe at constant speed.

    Attributes:
        name: What it is called in progress, messages and report.
        path: Poses T_WS `(n, 4, 4)` of the probe (frame S) in the workpiece's frame W, in mm, and the time between two
            of them in s. The beam is +Z, the laser line lies along X, and the sweep runs about along +Y or -Y.
    """

    name: str
    path: ScanPath

    @property
    def T_WS(self) -> FloatArray:
        """Poses `(n, 4, 4)` of the probe in the workpiece's frame, in mm."""
        return self.path.T_WS

    def reversed(self) -> "Strip":
        """Return the same strip swept the other way."""
        return replace(self, path=ScanPath(np.ascontiguousarray(self.path.T_WS[::-1]), self.path.step_s))
