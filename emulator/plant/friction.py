"""Friction with stiction: the Coulomb torque of a moving shaft, greater when it hardly moves (Stribeck)."""

from typing import NamedTuple


class Friction(NamedTuple):
    """Dry friction of the motor's shaft; its viscous part is in the motor's linear step."""

    coulomb_Nm: float
    static_Nm: float
    stribeck_s_rad: float  # the reciprocal of the Stribeck speed


def sliding_torque_Nm(friction: Friction, speed_rad_s: float) -> float:
    """Return the torque against the motion of a shaft that turns: Coulomb's, and what is left of stiction.

    The rational form of the Stribeck curve (Hess and Soom, 1990) needs no exponential.
    """
    coulomb, static, stribeck_s_rad = friction
    ratio = speed_rad_s * stribeck_s_rad
    return coulomb + (static - coulomb) / (1.0 + ratio * ratio)
