"""Friction with stiction: the Coulomb torque of a moving shaft, increased at low speed (Stribeck)."""

from typing import NamedTuple


class Friction(NamedTuple):
    """Dry friction of the motor's shaft. Viscous friction is part of the motor's linear step."""

    coulomb_Nm: float
    static_Nm: float
    stribeck_s_rad: float  # the reciprocal of the Stribeck speed


def sliding_torque_Nm(friction: Friction, speed_rad_s: float) -> float:
    """Return the torque against the motion of a turning shaft: Coulomb friction plus the rest of the stiction.

    The rational form of the Stribeck curve (Hess and Soom, 1990) needs no exponential.
    """
    coulomb, static, stribeck_s_rad = friction
    ratio = speed_rad_s * stribeck_s_rad
    return coulomb + (static - coulomb) / (1.0 + ratio * ratio)
