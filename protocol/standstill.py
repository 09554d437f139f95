"""Detect whether a braking table stands or has started to reverse, from rounded readings of its position; no I/O."""

from math import sqrt

# At standstill the position stays the same for at least this time.
_STILL_S = 0.25
# Fewer readings than this show nothing.
_LEAST_READINGS = 3


class Standstill:
    """Takes the readings of a table that brakes at a known rate.

    Near its reversal point, such a table stays within a step q of the readings for sqrt(2 q / rate) before and after
    it.
    """

    def __init__(self, rate_deg_s2: float, step_deg: float) -> None:
        """Start without readings; `step_deg` is the unit of their last decimal."""
        self._rate_deg_s2, self._step_deg = rate_deg_s2, step_deg
        self._least_change_deg: float | None = None
        self._direction = 0.0
        self._since_s = self._time_s = 0.0
        self._position_deg: float | None = None
        self._readings = 0
        self.has_turned = False

    def take(self, time_s: float, position_deg: float) -> None:
        """Take a reading. A change by one step and back is the rounding of a table at rest."""
        before_deg, self._time_s = self._position_deg, time_s
        change_deg = 0.0 if before_deg is None else position_deg - before_deg
        self._readings += 1
        if before_deg is None or abs(change_deg) > 0.5 * self._step_deg:
            if change_deg * self._direction < 0.0:
                self.has_turned = True
            self._direction = change_deg
            self._position_deg, self._since_s, self._readings = position_deg, time_s, 1
            if change_deg:
                self._least_change_deg = min(abs(change_deg), self._least_change_deg or abs(change_deg))

    @property
    def has_paused(self) -> bool:
        """Whether the position has not changed for as long as near a reversal point."""
        step_deg = self._least_change_deg or self._step_deg
        return self._readings > 1 and self._time_s - self._since_s >= sqrt(2.0 * step_deg / self._rate_deg_s2)

    @property
    def stands(self) -> bool:
        """Whether the position has not changed for so long that the table stands."""
        return self._readings >= _LEAST_READINGS and self._time_s - self._since_s >= _STILL_S
