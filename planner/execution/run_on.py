"""How far the table runs on when the line dies, and which A keeps that way short.

The last command stays in force: the table goes on to its P. P has to lie beyond the way that the table makes until the
next command, which may come late, and beyond the way that it needs to brake after that. The first is given by the
speed; the second is S^2 / 2A. So a bound on the run-on is a least A for each speed.
"""

import math

# P is rounded up to the wire's next number, and the encoder is behind the reference and overshoots a little.
_RESERVE_DEG = 0.5
# Commands are not evenly spaced: this much later than a step may the next one come, by plan.
UNEVEN = 1.25


def latest_s(duration_s: float) -> float:
    """Return how late the command after a step may come before the table brakes for the target of the step."""
    return max(0.1, 0.5 * duration_s)


def least_rate(speed_deg_s: float, step_s: float, run_on_deg: float) -> float:
    """Return the least A that keeps the run-on within a bound, at a speed and with a command each step.

    Infinite where the way until the next command alone is too long.
    """
    travel_deg = abs(speed_deg_s) * (UNEVEN * step_s + latest_s(step_s))
    braking_deg = run_on_deg - _RESERVE_DEG - travel_deg
    return 0.5 * speed_deg_s**2 / braking_deg if braking_deg > 0.0 else math.inf


def next_command_within_s(speed_deg_s: float, rate_deg_s2: float, step_s: float, run_on_deg: float) -> float:
    """Return how soon after a command the next one has to come, by plan, for the run-on to stay within a bound."""
    if speed_deg_s == 0.0:
        return math.inf
    travel_deg = run_on_deg - _RESERVE_DEG - 0.5 * speed_deg_s**2 / rate_deg_s2
    return travel_deg / abs(speed_deg_s) - latest_s(step_s)
