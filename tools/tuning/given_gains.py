"""Gain sets from a user's TOML file, to be judged on a table."""

from dataclasses import replace
from pathlib import Path
from typing import Any

from emulator.config.table_config import ConfigError, GainSetsConfig, TableConfig, load_config
from protocol.files.data_file import read_toml


def given_gains(path: Path, config_path: Path | None) -> tuple[TableConfig, GainSetsConfig]:
    """Return the table for the judgement, with the gain sets of its own configuration, and the gain sets of a file.

    Args:
        path: the TOML file with `[gains.ramp]`, `[gains.hold]` or both. Missing gains are those of the configuration.
            Without `config_path` its other sections are the table.
        config_path: TOML file of the table.

    Raises:
        ConfigError: a file is not valid, the first one has no gains, or the two describe different tables.
    """
    given = load_config(path)
    sections: dict[str, Any] = read_toml(path).get("gains", {})
    if not any(sections.values()):
        raise ConfigError(f"{path}: no gains; add [gains.ramp] or [gains.hold]")
    config = replace(given, gains=load_config().gains) if config_path is None else load_config(config_path)
    if config_path is not None and replace(given, gains=config.gains) not in (
        config,
        replace(load_config(), gains=config.gains),
    ):
        raise ConfigError(
            f"{path}: its table is not that of {config_path}; keep only its [gains] sections, or omit --config"
        )
    sets = {
        name: replace(
            getattr(config.gains, name),
            **{key: getattr(getattr(given.gains, name), key) for key in sections.get(name, {})},
        )
        for name in ("ramp", "hold")
    }
    return config, GainSetsConfig(**sets)
