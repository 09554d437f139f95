from pathlib import Path

import pytest

from protocol.conformance.profile.profile import ProfileError, load_profile, profile_from


def test_the_shipped_profile_is_that_of_the_specification() -> None:
    profile = load_profile()
    assert (profile.limits.speed_deg_s, profile.limits.acceleration_deg_s2) == (40.0, 100.0)
    assert (profile.power_on.speed_deg_s, profile.power_on.acceleration_deg_s2) == (10.0, 20.0)
    assert profile.range_deg == 4194304.0
    assert profile.resolution_deg == pytest.approx(0.1)
    assert profile.tolerance.rest_deg == 0.05


def test_a_file_changes_what_it_names(tmp_path: Path) -> None:
    file = tmp_path / "table.toml"
    file.write_text('[motion]\nreach_deg = 90\n[waive]\n"5.2/4" = "rounds as its printf does"\n')
    profile = load_profile(file)
    assert profile.motion.reach_deg == 90.0
    assert profile.motion.speed_deg_s == 40.0
    assert profile.waive == {"5.2/4": "rounds as its printf does"}


def test_a_profile_survives_its_record() -> None:
    profile = load_profile()
    assert profile_from(profile.as_dict(), "record") == profile


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("[motion]\nspeed_deg_s = 50\n", r"motion.speed_deg_s is 50; it must be greater than 0 and at most limits.spe"),
        ("[power_on]\nacceleration_deg_s2 = 0\n", r"power_on.acceleration_deg_s2 is 0; it must be greater than 0"),
        (
            "[tolerance]\ntracking_deg = 0.01\n",
            r"tolerance.tracking_deg is 0.01; it must be more than tolerance.rest_deg",
        ),
        (
            "[serial]\ntimeout_s = 0.04\n",
            r"serial.timeout_s is 0.04; it must be more than serial.latency_s, 0.01, and the time of 32 bytes, 0.033",
        ),
        (
            "[table]\ncounts_per_deg = 1e7\n",
            r"motion.reach_deg is 400; with table.counts_per_deg 1e\+07 the counter ends at 214.748",
        ),
        ("[serial]\ndecimals = 9\n", r"serial.decimals is 9; it must be a whole number from 1 to 6"),
        ("[serial]\ndecimals = 1.5\n", r"serial.decimals is 1.5; it must be a whole number from 1 to 6"),
        ("[serial]\nbaud = -1\n", r"serial.baud is -1; it must be a whole number"),
        ("[serial]\nerror_replies = 1\n", r"serial.error_replies is 1; it must be true or false"),
        ("[serial]\nbuffer_bytes = 16\n", r"serial.buffer_bytes is 16; it must be a whole number from 33 to"),
        ("[rig]\ntrigger_command = 'beep'\n", r"rig.trigger_command is 'beep'; it must be a list of texts"),
        ("[waive]\n'4.1/1' = 'no'\n", r"waive names 4.1/1, which is a must"),
        ("[waive]\n'9.9/9' = 'no'\n", r"waive names 9.9/9, which is not a clause"),
        ("[waive]\n'5.2/4' = ' '\n", r"waive.5.2/4 is empty; it must state the reason"),
        ("[waive]\n'5.2/4' = 3\n", r"waive.5.2/4 is 3; it must be a text"),
        ("[serial]\nparity = 1\n", r"serial.parity is not a known key; known are baud, buffer_bytes"),
        ("[nonsense]\na = 1\n", r"nonsense is not a known key; known are limits, motion"),
        ("motion = 3\n", r"motion is 3; it must be a table"),
        ("[motion\n", r"is not TOML"),
        (f"[motion]\nreach_deg = {10**400}\n", r"motion.reach_deg is 10+\.\.\.; it must be a finite number"),
        (f"[serial]\nbaud = {10**400}\n", r"serial.baud is 10+\.\.\.; it must be a whole number"),
    ],
)
def test_what_contradicts_itself_is_refused_in_one_line(text: str, words: str, tmp_path: Path) -> None:
    file = tmp_path / "table.toml"
    file.write_text(text)
    with pytest.raises(ProfileError, match=f"table.toml: .*{words}") as caught:
        load_profile(file)
    assert "\n" not in str(caught.value)


def test_a_file_that_is_not_there_is_a_profile_error(tmp_path: Path) -> None:
    with pytest.raises(ProfileError, match="cannot be read"):
        load_profile(tmp_path / "none.toml")
