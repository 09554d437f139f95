import numpy as np
import pytest

from planner.errors import ConfigurationNameError
from planner.kinematics.arm import Arm
from planner.kinematics.configuration import Configuration
from planner.kinematics.joint_configurations import configurations

VIPER = Arm.load()


def test_slots_are_stable() -> None:
    assert [configuration.label for configuration in Configuration] == [
        "LEFTY-ABOVE-FLIP",
        "LEFTY-ABOVE-NOFLIP",
        "LEFTY-BELOW-FLIP",
        "LEFTY-BELOW-NOFLIP",
        "RIGHTY-ABOVE-FLIP",
        "RIGHTY-ABOVE-NOFLIP",
        "RIGHTY-BELOW-FLIP",
        "RIGHTY-BELOW-NOFLIP",
    ]


def test_a_name_says_what_the_configuration_is() -> None:
    for configuration in Configuration:
        side, elbow, wrist = configuration.label.split("-")
        assert (configuration.lefty, configuration.above, configuration.flip) == (
            side == "LEFTY",
            elbow == "ABOVE",
            wrist == "FLIP",
        )


@pytest.mark.parametrize("text", ["righty-above-flip", "RIGHTY ABOVE FLIP", "Righty, Above, Flip", "RIGHTY_ABOVE_FLIP"])
def test_a_name_is_read_however_people_write_it(text: str) -> None:
    assert Configuration.parse(text) is Configuration.RIGHTY_ABOVE_FLIP


@pytest.mark.parametrize("text", ["", "LEFTY", "LEFTY-FLIP-ABOVE", "LEFTYABOVEFLIP", "all"])
def test_another_name_is_refused_with_what_is_allowed(text: str) -> None:
    with pytest.raises(ConfigurationNameError, match="use LEFTY or RIGHTY"):
        Configuration.parse(text)


def test_flags_are_those_of_the_closed_form_over_the_whole_range_of_the_viper() -> None:
    rng = np.random.default_rng(2)
    joints = rng.uniform(np.radians(VIPER.lower_deg), np.radians(VIPER.upper_deg), (10_000, 6))
    j2, j23 = joints[:, 1], joints[:, 1] + joints[:, 2]
    lefty = 75.0 + 270.0 * np.cos(j2) - 90.0 * np.cos(j23) + 295.0 * np.sin(j23) >= 0.0
    above = (np.degrees(joints[:, 2]) > 180.0 - np.degrees(np.arctan(295.0 / 90.0))) == lefty
    flip = joints[:, 4] < 0.0
    expected = [
        Configuration.parse(f"{'LEFTY' if side else 'RIGHTY'} {'ABOVE' if up else 'BELOW'} {'FLIP' if f else 'NOFLIP'}")
        for side, up, f in zip(lefty, above, flip, strict=True)
    ]
    np.testing.assert_array_equal(configurations(VIPER, joints), expected)
