"""The angle that the table runs on if the line fails, and the A that limits it.

The last command stays in force: the table continues to its P. P must be beyond the travel until the next command, which
may be late, plus the braking distance after that. The travel depends on the speed; the braking distance is S^2 / 2A. So
a bound on the run-on requires a minimum A for each speed.
"""

import math

# P is rounded up to the resolution of the protocol, and the encoder lags behind the reference and overshoots a little.
_RESERVE_DEG = 0.5
# Commands are not evenly spaced: the next one may be planned this much later than a step.
UNEVEN = 1.25


def latest_s(duration_s: float) -> float:
    """Return the maximum delay of the command after a step before the table brakes for the target of the step."""
    return max(0.1, 0.5 * duration_s)


def least_rate(speed_deg_s: float, step_s: float, run_on_deg: float) -> float:
    """Return the minimum A that keeps the run-on within a bound, at a speed and with a command in each step.

    Infinity if the travel until the next command alone exceeds the bound.
    """
    travel_deg = abs(speed_deg_s) * (UNEVEN * step_s + latest_s(step_s))
    braking_deg = run_on_deg - _RESERVE_DEG - travel_deg
    return 0.5 * speed_deg_s**2 / braking_deg if braking_deg > 0.0 else math.inf


def next_command_within_s(speed_deg_s: float, rate_deg_s2: float, step_s: float, run_on_deg: float) -> float:
    """Return the maximum planned time from a command to the next one for which the run-on stays within a bound."""
    if speed_deg_s == 0.0:
        return math.inf
    travel_deg = run_on_deg - _RESERVE_DEG - 0.5 * speed_deg_s**2 / rate_deg_s2
    return travel_deg / abs(speed_deg_s) - latest_s(step_s)
