"""The profile: the properties of the table under test, and the allowed range and speed of its motion."""

from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from protocol.conformance.profile.clauses import specification
from protocol.conformance.profile.sections import (
    MotionAllowed,
    MotionValues,
    RigProfile,
    SerialProfile,
    TableProfile,
    Tolerance,
)
from protocol.files.data_file import read_toml
from protocol.files.toml_section import section
from protocol.files.toml_table import TomlTable

DEFAULT_FILE = Path(__file__).with_name("default.toml")


class ProfileError(ValueError):
    """A profile that cannot be used. The message names the file, the key and the allowed values."""


@dataclass(frozen=True)
class Profile:
    """Everything that the suite assumes about the table under test."""

    table: TableProfile
    serial: SerialProfile
    limits: MotionValues
    power_on: MotionValues
    tolerance: Tolerance
    motion: MotionAllowed
    rig: RigProfile
    waive: Mapping[str, str]

    @property
    def resolution_deg(self) -> float:
        """The unit of the last decimal of a reply."""
        return float(10.0**-self.serial.decimals)

    @property
    def step_deg(self) -> float:
        """The resolution of a reading: one unit of the last decimal or one count, whichever is larger."""
        return max(self.resolution_deg, 1.0 / self.table.counts_per_deg)

    @property
    def range_deg(self) -> float:
        """The range of positions that a register can hold: from minus this value up to this value (excluded)."""
        return 2.0**31 / self.table.counts_per_deg

    @property
    def byte_s(self) -> float:
        """The transmission time of a byte."""
        return 10.0 / self.serial.baud if self.serial.baud else 0.0

    def as_dict(self) -> dict[str, Any]:
        """Return the profile as plain values, for a record."""
        return asdict(self)


def load_profile(path: Path | None = None) -> Profile:
    """Read a profile: the default profile, with the keys of the file at `path` replaced.

    Raises:
        ProfileError: the file cannot be read, a key, a type or a value is wrong, or two values are inconsistent.
    """
    default = TomlTable(DEFAULT_FILE.name, {}, error=ProfileError)
    top = default if path is None else TomlTable.load(path, ProfileError)
    return _profile(top, read_toml(DEFAULT_FILE))


def profile_from(values: Mapping[str, Any], source: str) -> Profile:
    """Return the profile from complete plain values; see `load_profile`."""
    return _profile(TomlTable(source, values, error=ProfileError), {})


def _profile(top: TomlTable, defaults: Mapping[str, Any]) -> Profile:
    waived = top.table("waive")
    profile = section(Profile, top, defaults, waive={number: waived.text(number) for number in waived.values})
    for sentence in (*_wrong_line(profile), *_wrong_motion(profile), *_wrong_waivers(profile)):
        raise ProfileError(f"{top.file}: {sentence}")
    return profile


def _wrong_line(profile: Profile) -> Iterator[str]:
    serial = profile.serial
    bytes_s = 32 * profile.byte_s
    if serial.timeout_s <= serial.latency_s + bytes_s:
        yield (
            f"serial.timeout_s is {serial.timeout_s:g}; it must be more than serial.latency_s, {serial.latency_s:g}, "
            f"and the time of 32 bytes, {bytes_s:.2g}"
        )


def _wrong_motion(profile: Profile) -> Iterator[str]:
    count_deg, reach_deg, tolerance = profile.table.counts_per_deg, profile.motion.reach_deg, profile.tolerance
    if reach_deg >= profile.range_deg:
        yield (
            f"motion.reach_deg is {reach_deg:g}; with table.counts_per_deg {count_deg:g} "
            f"the counter ends at {profile.range_deg:g}"
        )
    if tolerance.tracking_deg <= tolerance.rest_deg:
        yield (
            f"tolerance.tracking_deg is {tolerance.tracking_deg:g}; it must be more than tolerance.rest_deg, "
            f"{tolerance.rest_deg:g}"
        )
    for key in ("speed_deg_s", "acceleration_deg_s2"):
        limit = getattr(profile.limits, key)
        for name in ("motion", "power_on"):
            if not 0 < (value := getattr(getattr(profile, name), key)) <= limit:
                yield f"{name}.{key} is {value:g}; it must be greater than 0 and at most limits.{key}, {limit:g}"


def _wrong_waivers(profile: Profile) -> Iterator[str]:
    for number, reason in profile.waive.items():
        if number not in specification():
            yield f"waive names {number}, which is not a clause"
        elif specification()[number].level == "must":
            yield f"waive names {number}, which is a must; only a should can be waived"
        elif not reason.strip():
            yield f"waive.{number} is empty; it must state the reason"
