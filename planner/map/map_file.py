"""Configuration maps on disk: one npz file contains the maps of one or more arm configurations with their metadata.

`values` is `(n_configurations, n_locations, n_angles)`, `reasons` the same in bytes, `metadata` a JSON text. The same
maps give the same bytes.
"""

import json
import logging
import zipfile
import zlib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from planner.errors import PlannerError
from planner.kinematics.configuration import Configuration
from planner.map.config_map import ConfigurationMap, ConfigurationMapError
from protocol.files.whole_file import whole_file
from protocol.program.software_version import software_version

_log = logging.getLogger(__name__)

MAP_FILE = "map.npz"
"""The name of a map's file in a folder with results."""

_FORMAT = "seventh-axis configuration maps"
_FORMAT_VERSION = 1


# Exceptions that numpy raises for an npz file that is truncated, foreign, or declares arrays of any size.
_DAMAGED = (
    ValueError, EOFError, KeyError, AttributeError, TypeError, MemoryError, RecursionError, OverflowError,
    NotImplementedError, RuntimeError, zipfile.BadZipFile, zlib.error,
)  # fmt: skip


class MapFileError(PlannerError):
    """A file that cannot be read, is damaged, or contains no configuration maps."""


def save_maps(file: Path, maps: Mapping[Configuration, ConfigurationMap]) -> None:
    """Write maps of one scan to `file`, which appears when it is complete.

    Raises:
        ValueError: there is no map, or one has no reasons, or their shapes differ.
        OSError: the file cannot be written.
    """
    if not maps:
        raise ValueError("there is no map to save")
    stored = list(maps.values())
    metadata = {
        "format": _FORMAT,
        "format_version": _FORMAT_VERSION,
        "software_version": software_version(),
        "configurations": [configuration.label for configuration in maps],
        "epsilon": stored[0].epsilon,
        "maps": [dict(each.metadata) for each in stored],
    }
    arrays = {
        "values": np.stack([each.values for each in stored]),
        "reasons": np.stack([_reasons(each) for each in stored]),
        "metadata": np.array(json.dumps(metadata, sort_keys=True)),
    }
    with whole_file(file) as partial:
        np.savez_compressed(partial, allow_pickle=False, **arrays)


def load_maps(file: Path) -> dict[Configuration, ConfigurationMap]:
    """Return the maps in a file, by configuration.

    Raises:
        MapFileError: the file cannot be read, is damaged, or was not written by this program.
    """
    arrays = _read(file)
    try:
        metadata = json.loads(str(arrays["metadata"]))
        _check_format(file, metadata)
        configurations = [Configuration.parse(name) for name in metadata["configurations"]]
        parts = zip(configurations, arrays["values"], arrays["reasons"], metadata["maps"], strict=True)
        return {
            configuration: ConfigurationMap(values, reasons, metadata["epsilon"], _with_codes(about))
            for configuration, values, reasons, about in parts
        }
    except ConfigurationMapError as error:
        raise MapFileError(f"{file}: damaged: {error}") from error
    except (KeyError, TypeError, ValueError, AttributeError, OverflowError, RecursionError) as error:
        raise MapFileError(f"{file}: contains no configuration maps of this program") from error


def _read(file: Path) -> dict[str, Any]:
    try:
        with file.open("rb") as stream, np.load(stream, allow_pickle=False) as stored:
            _log.debug("read %s", file)
            return {name: stored[name] for name in stored.files}
    except OSError as error:
        raise MapFileError(f"{file}: cannot be read ({error.strerror or error})") from error
    except _DAMAGED as error:
        raise MapFileError(f"{file}: is damaged, or is not an npz file") from error


def _check_format(file: Path, metadata: Mapping[str, Any]) -> None:
    if metadata["format"] != _FORMAT:
        raise KeyError("format")
    if metadata["format_version"] != _FORMAT_VERSION:
        raise MapFileError(
            f"{file}: its format version is {metadata['format_version']}; this program reads {_FORMAT_VERSION}"
        )


def _with_codes(about: dict[str, Any]) -> dict[str, object]:
    """Return a map's metadata with the codes of its reasons as numbers again: JSON allows only texts as keys."""
    return about | {"reasons": {int(code): text for code, text in about.get("reasons", {}).items()}}


def _reasons(configuration_map: ConfigurationMap) -> np.ndarray[Any, np.dtype[np.uint8]]:
    if configuration_map.reasons is None:
        raise ValueError("a map without reasons cannot be saved")
    return configuration_map.reasons
