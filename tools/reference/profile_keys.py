"""The keys of a conformance profile, from the code that reads them.

The allowed values are taken from the error messages for values that are too small and too large.
"""

import json
from collections.abc import Iterator, Mapping
from dataclasses import asdict
from typing import Any

from protocol.conformance.profile.profile import DEFAULT_FILE, ProfileError, load_profile, profile_from
from tools.reference.keys import Key, comments, key_page

_INTRODUCTION = """A file for `python -m protocol.conformance --profile`: the properties of the table under test. It
needs only the keys that differ from the default profile, which is that of the default table. A bound that depends on
another key is shown for that key's default."""
_WAIVE = Key("waive.CLAUSE", "a text", "", "why the table does not keep this clause; only clauses of level `should`")
_PROBES: tuple[object, ...] = ({}, 0, -1, 1e200, 10**9)


def profile_page() -> str:
    """Return the page of the profile's keys."""
    return key_page("Keys of a profile", _INTRODUCTION, profile_keys())


def profile_keys() -> list[Key]:
    """Return the keys of every section."""
    profile = asdict(load_profile())
    return [*_keys(profile, comments(DEFAULT_FILE.read_text(encoding="utf-8"))), _WAIVE]


def _keys(profile: Mapping[str, Any], notes: Mapping[str, str]) -> Iterator[Key]:
    for section, values in profile.items():
        if section == "waive":
            continue  # its keys are the numbers of clauses
        for key, value in values.items():
            name = f"{section}.{key}"
            default = f"{value:g}" if isinstance(value, float) else json.dumps(value)
            yield Key(name, _allowed(profile, section, key), default, notes.get(name, ""))


def _allowed(profile: Mapping[str, Any], section: str, key: str) -> str:
    """Return the content of the error messages for the key, each once."""
    said = []
    for probe in _PROBES:
        try:
            profile_from({**profile, section: profile[section] | {key: probe}}, "profile")
        except ProfileError as error:
            object_and_value, _, allowed = str(error).removeprefix("profile: ").partition("; ")
            if object_and_value.startswith(f"{section}.{key} "):
                said.append(allowed.removeprefix("it must be "))
    return "; ".join(dict.fromkeys(said))
