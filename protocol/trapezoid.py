"""The motion that clauses 7.1 and 7.3 prescribe, in closed form: what a table's reference should do.

It is not the code of a table: phases of constant acceleration, computed at once when a motion is commanded.
"""

import math
from typing import NamedTuple


class Phase(NamedTuple):
    """A stretch of constant acceleration."""

    duration_s: float
    acceleration_deg_s2: float


class Motion(NamedTuple):
    """A motion from a position and a speed to a target, phase by phase."""

    start_deg: float
    start_speed_deg_s: float
    target_deg: float
    phases: tuple[Phase, ...]

    @property
    def duration_s(self) -> float:
        """The time from the command until the reference stands at the target."""
        return sum(phase.duration_s for phase in self.phases)

    def at(self, time_s: float) -> tuple[float, float]:
        """Return the reference's position and speed at a time since the command."""
        if time_s >= self.duration_s:
            return self.target_deg, 0.0
        position, speed = self.start_deg, self.start_speed_deg_s
        for phase in self.phases:
            step = min(max(time_s, 0.0), phase.duration_s)
            position += speed * step + 0.5 * phase.acceleration_deg_s2 * step**2
            speed += phase.acceleration_deg_s2 * step
            time_s -= phase.duration_s
            if time_s <= 0.0:
                break
        return position, speed


def braking_way_deg(speed_deg_s: float, rate_deg_s2: float) -> float:
    """Return the signed way from a speed to standstill: there is the nearest point at which the table can stand."""
    return speed_deg_s * abs(speed_deg_s) / (2.0 * rate_deg_s2)


def plan(start_deg: float, speed_deg_s: float, target_deg: float, top_deg_s: float, rate_deg_s2: float) -> Motion:
    """Return the motion to a target with top speed S and acceleration A (clauses 7.1/1, 7.1/2, 7.3/2 to 7.3/4)."""
    phases: list[Phase] = []
    position, speed = start_deg, speed_deg_s
    braking_deg = braking_way_deg(speed, rate_deg_s2)
    direction = math.copysign(1.0, target_deg - position - braking_deg)
    if speed * direction < 0.0 or (speed != 0.0 and target_deg == position + braking_deg):
        phases.append(Phase(abs(speed) / rate_deg_s2, -math.copysign(rate_deg_s2, speed)))
        position, speed = position + braking_deg, 0.0
    phases += _ahead(abs(target_deg - position), abs(speed), direction, top_deg_s, rate_deg_s2)
    return Motion(start_deg, speed_deg_s, target_deg, tuple(phases))


def _ahead(distance_deg: float, speed: float, direction: float, top: float, rate: float) -> list[Phase]:
    """Return the phases to a target ahead, not nearer than the braking distance."""
    peak = min(math.sqrt(rate * distance_deg + speed**2 / 2.0), max(top, 0.0))
    change = abs(peak - speed) / rate
    ramps_deg = 0.5 * (speed + peak) * change + peak**2 / (2.0 * rate)
    cruise_s = max(distance_deg - ramps_deg, 0.0) / peak if peak else 0.0
    towards_peak = rate if peak >= speed else -rate
    return [Phase(change, direction * towards_peak), Phase(cruise_s, 0.0), Phase(peak / rate, -direction * rate)]
