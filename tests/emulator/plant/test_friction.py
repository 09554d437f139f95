import pytest
from hypothesis import given
from hypothesis import strategies as st

from emulator.plant.friction import Friction, sliding_torque_Nm

FRICTION = Friction(coulomb_Nm=1.0e-3, static_Nm=1.4e-3, stribeck_s_rad=1.0 / 5.0)


@pytest.mark.parametrize(("speed_rad_s", "torque_Nm"), [(0.0, 1.4e-3), (5.0, 1.2e-3), (1e6, 1.0e-3)])
def test_stiction_fades_to_coulombs_torque(speed_rad_s: float, torque_Nm: float) -> None:
    """At the Stribeck speed half of it is left."""
    assert sliding_torque_Nm(FRICTION, speed_rad_s) == pytest.approx(torque_Nm)


@given(st.floats(0, 1000), st.floats(0, 1000))
def test_it_falls_with_the_speed_and_is_the_same_both_ways(slower: float, faster: float) -> None:
    slower, faster = sorted((slower, faster))
    assert sliding_torque_Nm(FRICTION, slower) >= sliding_torque_Nm(FRICTION, faster) >= FRICTION.coulomb_Nm
    assert sliding_torque_Nm(FRICTION, -faster) == sliding_torque_Nm(FRICTION, faster)
