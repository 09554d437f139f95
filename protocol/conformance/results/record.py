"""The record of a session: one complete JSON file, and JUnit XML for machines that count tests."""

import json
import math
import platform
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any, Literal
from xml.etree import ElementTree as ET

from protocol.conformance.bench.wire import Event
from protocol.conformance.judgement.reference import Expectation, MotionRecord, Sample
from protocol.conformance.judgement.verdict import Measurement, Verdict
from protocol.conformance.profile.profile import Profile, ProfileError, profile_from
from protocol.conformance.session.suite import Outcome
from protocol.files import whole_file
from protocol.files.data_file import DataFileError, read_json

FORMAT = "seventh-axis conformance record"
VERSION = 1

_WAYS: tuple[Literal["sent", "received", "beside"], ...] = ("sent", "received", "beside")
_UNWRITABLE = re.compile("[\x00-\x08\x0b\x0c\x0e-\x1f\x7f\ud800-\udfff\ufffe\uffff]")
"""Characters that UTF-8 or XML cannot hold.

A device name can contain them, because it may contain any byte except zero and slash.
"""
_DEED = re.compile(rb"reopen|trigger|power_cycle|preset -?[0-9]{1,10}")


class RecordError(ValueError):
    """A file that is not a record, or a record of another version. The message names the file."""


@dataclass(frozen=True)
class Header:
    """What was tested, when, and with which software."""

    device: str
    profile: Profile
    seed: int
    home_deg: int
    capabilities: Sequence[str]
    begun: str | None
    """Date and time. None in simulated time, so that each run gives the same record."""


@dataclass(frozen=True)
class RecordedCase:
    """The part of a record for one case: enough to send it again."""

    id: str
    wire: tuple[Event, ...]


@dataclass(frozen=True)
class Record:
    """A record that was read from a file."""

    profile: Profile
    home_deg: int
    cases: tuple[RecordedCase, ...]


def versions() -> dict[str, str]:
    """Return the versions of all software involved."""
    found = {"python": platform.python_version(), "system": platform.platform()}
    for package in ("seventh-axis", "pyserial", "hypothesis"):
        try:
            found[package] = version(package)
        except PackageNotFoundError:
            found[package] = "not installed"
    return found


def count_verdicts(outcomes: Iterable[Outcome]) -> dict[Verdict, int]:
    """Return how many cases ended with each verdict, without verdicts that did not occur."""
    ends = [outcome.verdict for outcome in outcomes]
    return {verdict: ends.count(verdict) for verdict in Verdict if verdict in ends}


def write_record(path: Path, header: Header, outcomes: Sequence[Outcome]) -> None:
    """Write `record.json`. The file appears under its name when it is complete."""
    record = {
        "format": FORMAT,
        "version": VERSION,
        "device": header.device,
        "begun": header.begun,
        "seed": header.seed,
        "home_deg": header.home_deg,
        "versions": versions(),
        "capabilities": sorted(header.capabilities),
        "profile": header.profile.as_dict(),
        "verdicts": count_verdicts(outcomes),
        "cases": [_case(outcome) for outcome in outcomes],
    }
    write_whole(path, json.dumps(record, indent=1, ensure_ascii=True) + "\n")


def read_record(path: Path) -> Record:
    """Return a record for a replay.

    Raises:
        RecordError: the file cannot be read, or is not a record of this version.
    """
    try:
        record = read_json(path)
    except DataFileError as error:
        raise RecordError(str(error)) from error
    if not isinstance(record, dict) or record.get("format") != FORMAT:
        raise RecordError(f"{path}: is not a {FORMAT}")
    if record.get("version") != VERSION:
        raise RecordError(f"{path}: has version {record.get('version')!r}; this program reads version {VERSION}")
    try:
        cases = tuple(
            RecordedCase(case["id"], tuple(_event(*event) for event in case["wire"])) for case in record["cases"]
        )
        return Record(profile_from(record["profile"], str(path)), round(float(record["home_deg"])), cases)
    except (KeyError, TypeError, ValueError, AttributeError, OverflowError) as error:
        if isinstance(error, ProfileError):
            raise RecordError(str(error)) from error
        raise RecordError(f"{path}: is damaged: {type(error).__name__} {error}") from error


def write_junit(path: Path, header: Header, outcomes: Sequence[Outcome], durations_s: Sequence[float]) -> None:
    """Write the verdicts as JUnit XML, with the real duration of each case.

    The file appears under its name when it is complete.
    """
    counts = count_verdicts(outcomes)
    numbers = {"tests": len(outcomes), "failures": counts.get(Verdict.FAIL, 0), "errors": counts.get(Verdict.ERROR, 0)}
    suite = ET.Element(
        "testsuite",
        {"name": f"conformance of {header.device}", "time": f"{sum(durations_s):.3f}"}
        | {key: str(value) for key, value in numbers.items()}
        | {"skipped": str(counts.get(Verdict.SKIPPED, 0))},
    )
    for outcome, duration_s in zip(outcomes, durations_s, strict=True):
        name = f"{outcome.case.id} {outcome.case.run.__name__}"
        section = outcome.case.clause.number.partition("/")[0]
        attributes = {"classname": f"protocol.conformance.{section}", "name": name, "time": f"{duration_s:.3f}"}
        element = ET.SubElement(suite, "testcase", attributes)
        tag = {Verdict.FAIL: "failure", Verdict.ERROR: "error", Verdict.SKIPPED: "skipped"}.get(outcome.verdict)
        if tag:
            detail = ET.SubElement(element, tag, {"message": _xml_text(outcome.reason)})
            detail.text = f"{outcome.case.clause.level}: {outcome.case.clause.text}"
        if outcome.measurements:
            lines = (f"{measurement.verdict}: {measurement}" for measurement in outcome.measurements)
            ET.SubElement(element, "system-out").text = "\n".join(lines)
    suites = ET.Element("testsuites")
    suites.append(suite)
    ET.indent(suites)
    write_whole(path, '<?xml version="1.0" encoding="utf-8"?>\n' + ET.tostring(suites, encoding="unicode") + "\n")


def write_whole(path: Path, text: str) -> None:
    """Write a file that appears when it is whole; unwritable characters are escaped.

    Raises:
        OSError: the file cannot be written; nothing remains of it.
    """
    try:
        whole_file.write_whole(path, _UNWRITABLE.sub(_escaped, text))
    except OSError as error:
        raise OSError(f"{path}: cannot write: {error.strerror}") from error


def _event(time_s: object, way: object, data: str) -> Event:
    """Return an event as it was recorded, or raise ValueError: a table will be moved according to it."""
    if not isinstance(time_s, int | float) or not math.isfinite(time_s):
        raise ValueError(f"{time_s!r} is not a time")
    known = next((one for one in _WAYS if one == way), None)
    if known is None:
        raise ValueError(f"{way!r} is not one of {', '.join(_WAYS)}")
    event = Event(time_s, known, data.encode("latin-1"))
    if known == "beside" and not _DEED.fullmatch(event.data):
        raise ValueError(f"{data!r} is not an action of the rig")
    return event


def _case(outcome: Outcome) -> dict[str, Any]:
    return {
        "id": outcome.case.id,
        "level": outcome.case.clause.level,
        "clause": outcome.case.clause.text,
        "how": outcome.case.how,
        "verdict": outcome.verdict,
        "reason": outcome.reason,
        "spoiled": list(outcome.spoiled),
        "seconds": round(outcome.seconds, 6),
        "measurements": [_measurement(measurement) for measurement in outcome.measurements],
        "motion": None if outcome.motion is None else _motion(outcome.motion),
        "wire": [[round(time_s, 6), way, data.decode("latin-1")] for time_s, way, data in outcome.wire],
    }


def _measurement(measurement: Measurement) -> dict[str, Any]:
    return {
        "name": measurement.name,
        "value": round(measurement.value, 9),
        "unit": measurement.unit,
        "least": measurement.least,
        "most": measurement.most,
        "verdict": measurement.verdict,
    }


def _motion(motion: MotionRecord) -> Mapping[str, Any]:
    def sample(one: Sample) -> list[float]:
        return [round(value, 6) for value in one]

    def expectation(one: Expectation) -> dict[str, Any]:
        return {
            "began_s": round(one.began_s, 6),
            "start_deg": one.motion.start.angle_deg,
            "start_speed_deg_s": one.motion.start.speed_deg_s,
            "target_deg": one.motion.target_deg,
            "phases": [list(segment) for segment in one.motion.segments],
        }

    return {
        "expected": [expectation(one) for one in motion.expectations],
        "samples": [sample(one) for one in motion.samples],
    }


def _escaped(match: re.Match[str]) -> str:
    return match.group().encode("unicode_escape", "surrogatepass").decode("ascii")


def _xml_text(text: str) -> str:
    """Return a text without the characters that XML cannot hold."""
    return "".join(character if character.isprintable() else "?" for character in text)
