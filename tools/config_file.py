"""A table's constants as a file for `--config`."""

from collections.abc import Iterator
from dataclasses import fields, is_dataclass
from typing import Any

from emulator.config.table_config import TableConfig, load_config


def config_toml(config: TableConfig, comment: str, always: frozenset[str] = frozenset()) -> str:
    """Return the constants that differ from the default ones, in the format of `load_config`, with all digits.

    Args:
        config: the table; its faults are omitted.
        comment: written at the top; may have several lines.
        always: keys such as `gains.ramp.integral_time_s` that are written even if they have the default values.
    """
    lines = [f"# {line}" for line in comment.splitlines()]
    default = dict(_numbers(load_config()))
    last_section = ""
    for key, value in _numbers(config):
        section, _, name = key.rpartition(".")
        if value == default[key] and key not in always:
            continue
        if section != last_section:
            lines += ["", f"[{section}]"]
            last_section = section
        lines.append(f"{name} = {str(value).lower() if isinstance(value, bool) else repr(value)}")
    return "\n".join(lines) + "\n"


def _numbers(section: Any, where: str = "") -> Iterator[tuple[str, float | int | bool]]:  # noqa: ANN401  # a section of any kind
    for entry in fields(section):
        value = getattr(section, entry.name)
        if is_dataclass(value):
            yield from _numbers(value, f"{where}{entry.name}.")
        elif not isinstance(value, tuple):
            yield where + entry.name, value
