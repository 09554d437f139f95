"""The profile: what is known of the table under test, and how far and fast it may be moved."""

from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass, fields
from pathlib import Path
from typing import Any, TypeVar

from protocol.conformance.profile.clauses import specification
from protocol.conformance.profile.sections import (
    MotionAllowed,
    MotionValues,
    RigProfile,
    SerialProfile,
    TableProfile,
    Tolerance,
)
from protocol.data_file import DataFileError, did_you_mean, read_toml, shown

DEFAULT_FILE = Path(__file__).with_name("default.toml")


_LARGEST = 1e300
"""A whole number may be beyond all floats."""


class ProfileError(ValueError):
    """A profile that cannot be used; the message names the file, the key and what is allowed."""


@dataclass(frozen=True)
class Profile:
    """Everything that the suite takes for granted about the table under test."""

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
        """The unit of the last decimal in a reply."""
        return float(10.0**-self.serial.decimals)

    @property
    def step_deg(self) -> float:
        """The least change of position that a reading shows: a unit of the last decimal, or a count if that is more."""
        return max(self.resolution_deg, 1.0 / self.table.counts_per_deg)

    @property
    def range_deg(self) -> float:
        """The positions that a register holds: from minus this up to this, without it."""
        return 2.0**31 / self.table.counts_per_deg

    @property
    def byte_s(self) -> float:
        """The time that a byte takes on the line."""
        return 10.0 / self.serial.baud if self.serial.baud else 0.0

    def as_dict(self) -> dict[str, Any]:
        """Return the profile as plain values, for a record."""
        return asdict(self)


def load_profile(path: Path | None = None) -> Profile:
    """Read a profile: the default table's, with the keys of the file at `path` over them.

    Raises:
        ProfileError: the file cannot be read, a key, a type or a value is wrong, or two values contradict each other.
    """
    values = _read(DEFAULT_FILE)
    source = DEFAULT_FILE.name
    if path is not None:
        values, source = _merged(values, _read(path), str(path)), str(path)
    return profile_from(values, source)


def profile_from(values: Mapping[str, Any], source: str) -> Profile:
    """Return the profile that plain values, complete, describe; see `load_profile`."""
    profile = Profile(
        _section(TableProfile, values, "table", source),
        _section(SerialProfile, values, "serial", source),
        _section(MotionValues, values, "limits", source),
        _section(MotionValues, values, "power_on", source),
        _section(Tolerance, values, "tolerance", source),
        _section(MotionAllowed, values, "motion", source),
        _section(RigProfile, values, "rig", source),
        {number: str(_value(str, reason, f"{source}: waive.{number}")) for number, reason in values["waive"].items()},
    )
    _check_together(profile, source)
    return profile


def _read(path: Path) -> dict[str, Any]:
    try:
        return read_toml(path)
    except DataFileError as error:
        raise ProfileError(str(error)) from error


def _merged(defaults: dict[str, Any], changes: Mapping[str, Any], source: str) -> dict[str, Any]:
    merged = dict(defaults)
    for section, keys in changes.items():
        if section not in defaults:
            raise ProfileError(
                f"{source}: [{section}] is no section; there are {', '.join(defaults)}{did_you_mean(section, defaults)}"
            )
        if not isinstance(keys, dict):
            raise ProfileError(f"{source}: {section} must be a section, not {shown(keys)}")
        unknown = [key for key in keys if section != "waive" and key not in defaults[section]]
        if unknown:
            raise ProfileError(
                f"{source}: {section}.{unknown[0]} is not a key; allowed are {', '.join(defaults[section])}"
                f"{did_you_mean(unknown[0], defaults[section])}"
            )
        merged[section] = defaults[section] | keys
    return merged


_Section = TypeVar("_Section")


def _section(kind: type[_Section], values: Mapping[str, Any], name: str, source: str) -> _Section:
    arguments = {
        entry.name: _value(entry.type, values[name][entry.name], f"{source}: {name}.{entry.name}")
        for entry in fields(kind)  # type: ignore[arg-type]  # every kind is a dataclass
    }
    return kind(**arguments)


def _value(wanted: object, value: object, where: str) -> object:
    """Return a value of the wanted type; all numbers of a profile are at least 0."""
    if wanted is bool or wanted is str:
        if not isinstance(value, wanted):
            raise ProfileError(
                f"{where} is {shown(value)}; it must be {'true or false' if wanted is bool else 'a text'}"
            )
        return value
    if wanted is int or wanted is float:
        kinds = (int,) if wanted is int else (int, float)
        if not isinstance(value, kinds) or isinstance(value, bool) or not 0 <= value <= _LARGEST:
            raise ProfileError(
                f"{where} is {shown(value)}; it must be a {'whole number' if wanted is int else 'number'} from 0 up"
            )
        return wanted(value)
    if not isinstance(value, list | tuple) or not all(isinstance(word, str) for word in value):
        raise ProfileError(f"{where} is {shown(value)}; it must be a list of words")
    return tuple(value)


def _check_together(profile: Profile, source: str) -> None:
    for sentences in (_wrong_line(profile), _wrong_motion(profile), _wrong_waivers(profile)):
        for sentence in sentences:
            raise ProfileError(f"{source}: {sentence}")


def _wrong_line(profile: Profile) -> Iterator[str]:
    serial = profile.serial
    if not 1 <= serial.decimals <= 6:
        yield f"serial.decimals is {serial.decimals}; it must be 1 to 6"
    if serial.buffer_bytes < 33:
        yield f"serial.buffer_bytes is {serial.buffer_bytes}; a line alone needs 33"
    bytes_s = 32 * profile.byte_s
    if serial.timeout_s <= serial.latency_s + bytes_s:
        yield (
            f"serial.timeout_s is {serial.timeout_s:g}; it must be more than serial.latency_s, {serial.latency_s:g}, "
            f"and the time of 32 bytes, {bytes_s:.2g}"
        )


def _wrong_motion(profile: Profile) -> Iterator[str]:
    count_deg, reach_deg, tolerance = profile.table.counts_per_deg, profile.motion.reach_deg, profile.tolerance
    if count_deg <= 0:
        yield "table.counts_per_deg is 0; it must be above 0"
    elif reach_deg >= profile.range_deg:
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
        for section in ("motion", "power_on"):
            if not 0 < (value := getattr(getattr(profile, section), key)) <= limit:
                yield (f"{section}.{key} is {value:g}; it must be greater than 0 and at most limits.{key}, {limit:g}")


def _wrong_waivers(profile: Profile) -> Iterator[str]:
    for number, reason in profile.waive.items():
        if number not in specification():
            yield f"waive names {number}, which is no clause"
        elif specification()[number].level == "must":
            yield f"waive names {number}, which is a must; only a should can be waived"
        elif not reason.strip():
            yield f"waive.{number} is empty; it must say why"
