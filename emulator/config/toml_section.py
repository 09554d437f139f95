"""A section of a TOML file as a frozen dataclass. Each number has the right type and is within its range.

A section is a dataclass whose fields are declared with `quantity`, or are sections.
"""

import math
from dataclasses import field, fields, is_dataclass
from typing import Any, get_type_hints

from emulator.config.gear_ratio import ratio_in
from emulator.faults.parameter import brief
from protocol.data_file import did_you_mean


class ConfigError(ValueError):
    """A configuration that cannot be used. The message names the file, the key and the allowed values."""


def quantity(
    *, above: float | None = None, least: float | None = None, most: float | None = None, fraction: bool = False
) -> Any:  # noqa: ANN401  # returned in place of a value of the annotated type
    """Declare a number that must be > `above`, >= `least` and <= `most`; `fraction` allows a text such as "7/3"."""
    return field(metadata={"above": above, "least": least, "most": most, "fraction": fraction})


def merged(defaults: dict[str, Any], changes: dict[str, Any], source: str, where: str = "") -> dict[str, Any]:
    """Return the defaults with changes applied.

    Args:
        defaults: all keys.
        changes: the content of another file, with any of these keys.
        source: the other file, for messages.
        where: the section's name with a point; empty at the top level.

    Raises:
        ConfigError: a key is unknown, or a section is missing.
    """
    result = dict(defaults)
    for key, value in changes.items():
        if key not in defaults:
            raise ConfigError(
                f"{source}: {where}{key[:60]} is not a key; allowed here are {', '.join(defaults)}"
                f"{did_you_mean(key[:60], defaults)}"
            )
        nested = isinstance(defaults[key], dict)
        if nested and not isinstance(value, dict):
            raise ConfigError(f"{source}: {where + key} must be a section, not {brief(value)}")
        result[key] = merged(defaults[key], value, source, f"{where}{key}.") if nested else value
    return result


def section(kind: type[Any], values: dict[str, Any], source: str, where: str = "") -> Any:  # noqa: ANN401  # an instance of `kind`
    """Return a section of a kind. Tuples are copied without a check.

    Raises:
        ConfigError: a number has another type or is outside of its range.
    """
    types = get_type_hints(kind)
    arguments: dict[str, Any] = {}
    for entry in fields(kind):
        name = f"{where}.{entry.name}" if where else entry.name
        wanted, value = types[entry.name], values[entry.name]
        if isinstance(value, tuple):
            arguments[entry.name] = value  # checked before
        elif is_dataclass(wanted):
            arguments[entry.name] = section(wanted, value, source, name)  # type: ignore[arg-type]  # a dataclass's type
        else:
            arguments[entry.name] = _number(wanted, value, entry.metadata, f"{source}: {name}")
    constructor: Any = kind
    return constructor(**arguments)


def _number(wanted: type, value: object, limits: Any, where: str) -> float | int | bool:  # noqa: ANN401  # a field's metadata
    if wanted is bool or isinstance(value, bool):
        if wanted is bool and isinstance(value, bool):
            return value
        raise ConfigError(f"{where} is {brief(value)}; it must be {'true or false' if wanted is bool else 'a number'}")
    if limits["fraction"] and isinstance(value, str):
        try:
            value = ratio_in(value)
        except ValueError:
            raise ConfigError(
                f'{where} is {brief(value)}; it must be a number, or a fraction of integers such as "2197/27"'
            ) from None
    if not isinstance(value, int if wanted is int else (int, float)):
        raise ConfigError(f"{where} is {brief(value)}; it must be a {'whole number' if wanted is int else 'number'}")
    if isinstance(value, float) and not math.isfinite(value):
        raise ConfigError(f"{where} is {brief(value)}; it must be finite")
    above, least, most = (limits[key] for key in ("above", "least", "most"))
    broken = (
        (above is not None and value <= above, f"greater than {above}"),
        (least is not None and value < least, f"at least {least}"),
        (most is not None and value > most, f"at most {most}"),
    )
    for is_broken, allowed in broken:
        if is_broken:
            raise ConfigError(f"{where} is {brief(value)}; it must be {allowed}")
    return wanted(value)  # type: ignore[no-any-return]  # int or float
