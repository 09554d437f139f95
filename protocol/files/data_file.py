"""Read JSON and TOML files that users write or other programs produce. Each error is one sentence."""

import difflib
import json
import logging
import tomllib
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

_log = logging.getLogger(__name__)

_MB = 1024 * 1024
_LARGEST_BYTES = 256 * _MB
_LARGEST_TOML_BYTES = _MB  # users write it
_LONGEST_VALUE = 80


class DataFileError(ValueError):
    """A file that cannot be used. The message names the file and the reason."""


def read_text(path: Path, largest_bytes: int = _LARGEST_BYTES) -> str:
    """Return a text file in UTF-8, with or without a byte order mark.

    A device or a pipe has no known size; it is read up to the limit.

    Raises:
        DataFileError: the file cannot be read, is not text, or is too large.
    """
    try:
        with path.open("rb") as file:
            data = file.read(largest_bytes + 1)
        if len(data) > largest_bytes:
            raise DataFileError(f"{path}: is larger than {largest_bytes // _MB} MB; is this the right file?")
        _log.debug("read %s, %d bytes", path, len(data))
        return data.decode("utf-8-sig")
    except (OSError, ValueError) as error:
        if isinstance(error, DataFileError):
            raise
        reason = error.strerror if isinstance(error, OSError) else "it is not text in UTF-8"
        raise DataFileError(f"{path}: cannot be read: {reason or error}") from error


def read_json(path: Path) -> Any:  # noqa: ANN401 - any content of the file
    """Return the content of a JSON file; see `read_text`. NaN and infinity are not JSON."""
    return _parsed(read_text(path), path, "JSON", lambda text: json.loads(text, parse_constant=_no_number))


def read_toml(path: Path) -> dict[str, Any]:
    """Return the content of a TOML file; see `read_text`."""
    text = read_text(path, _LARGEST_TOML_BYTES)
    values: dict[str, Any] = _parsed(text, path, "TOML", tomllib.loads)
    return values


def shown(value: object) -> str:
    """Return a value as text for a message, shortened if it is long."""
    try:
        text = repr(value)
    except (ValueError, RecursionError):  # an integer of thousands of digits, or very deep nesting
        return f"a very long {type(value).__name__}"
    return shortened(text)


def shortened(text: str) -> str:
    """Return a text for a message, cut if it is long."""
    return text if len(text) <= _LONGEST_VALUE else f"{text[:_LONGEST_VALUE]}..."


def did_you_mean(name: str, known: Iterable[str]) -> str:
    """Return a suggestion of the known name nearest to an unknown one, or an empty text if no name is near.

    Upper and lower case are equal.
    """
    folded = {each.casefold(): each for each in known}
    near = difflib.get_close_matches(name.casefold(), folded, n=1, cutoff=0.7)
    return f"; did you mean {folded[near[0]]}?" if near else ""


def _parsed(text: str, path: Path, kind: str, parse: Callable[[str], Any]) -> Any:  # noqa: ANN401 - as above
    try:
        return parse(text)
    except RecursionError as error:
        raise DataFileError(f"{path}: is not usable {kind}: it is nested too deeply") from error
    except ValueError as error:
        raise DataFileError(f"{path}: is not {kind}: {_one_line(error)}") from error


def _one_line(error: Exception) -> str:
    return " ".join(str(error).split())


def _no_number(name: str) -> float:
    raise ValueError(f"{name} is not a number")
