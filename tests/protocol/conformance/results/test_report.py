"""The report: text from a device is shown but never interpreted, and every mark is within its picture."""

import dataclasses
import json
import re
from pathlib import Path
from xml.etree import ElementTree as ET

import pytest

from protocol.conformance.bench.wire import Event
from protocol.conformance.cases.catalog import chosen_cases
from protocol.conformance.judgement.verdict import Measurement, Verdict
from protocol.conformance.profile.profile import load_profile
from protocol.conformance.results.record import Header, write_junit, write_record
from protocol.conformance.results.report import write_report
from protocol.conformance.results.svg_plot import range_bar
from protocol.conformance.session.suite import Outcome

NASTY = b"<script>alert('&amp;')</script>\x1b[31m\xff\x00"


def report_of(outcome: Outcome, folder: Path) -> str:
    profile = load_profile()
    named = dataclasses.replace(profile, table=dataclasses.replace(profile.table, name="<b>hall B</b>"))
    header = Header('/dev/"tty"', named, 0, 0, [], None)
    write_report(folder / "report.html", header, [outcome], lambda case: f"repeat {case.id} > 'file'")
    return (folder / "report.html").read_text(encoding="utf-8")


def test_what_a_device_sends_is_shown_and_not_obeyed(tmp_path: Path) -> None:
    wire = (Event(0.0, "sent", b"H\r"), Event(0.01, "received", NASTY + b"\r"))
    (case, *_) = chosen_cases(["5.2/1"])
    report = report_of(
        Outcome(case, Verdict.FAIL, f"b'H' got {NASTY!r}", wire=wire, spoiled=("<i>late</i>",)), tmp_path
    )
    assert not re.search(r"<script|<b>hall|<i>late|[\x00-\x09\x0b-\x1f\xff]", report)
    assert r"&lt;script&gt;alert('&amp;amp;')&lt;/script&gt;\x1b[31m\xff\x00" + "\u21b5" in report
    assert "&lt;b&gt;hall B&lt;/b&gt; at /dev/&quot;tty&quot;" in report
    assert "repeat 5.2/1 &gt; &#x27;file&#x27;" in report


@pytest.mark.parametrize("value", [-1e9, -1.0, 0.0, 0.5, 1.0, 2.0, 1e9])
def test_the_mark_of_a_measurement_lies_within_its_bar(value: float) -> None:
    bar = range_bar(value, 0.0, 1.0, "fail")
    width = float(re.findall(r'viewBox="0 0 (\d+) 12"', bar)[0])
    middle, radius = (float(re.findall(rf'{name}="([0-9.]+)"', bar)[0]) for name in ("cx", " r"))
    assert radius <= middle <= width - radius


@pytest.mark.parametrize("name", ["/dev/tty\udcff", "/dev/tty\x01", "/dev/tty\x7f\x1b[31m\udc80", "/dev/\ufffe\uffff"])
def test_any_name_of_a_device_costs_no_record_and_no_report(tmp_path: Path, name: str) -> None:
    (case, *_) = chosen_cases(["5.2/1"])
    outcome = Outcome(case, Verdict.FAIL, f"{name}: no answer", wire=(Event(0.0, "sent", b"H\r"),))
    header = Header(name, load_profile(), 0, 0, [], None)
    write_report(tmp_path / "report.html", header, [outcome], lambda _case: f"--port {name}")
    write_record(tmp_path / "record.json", header, [outcome])
    write_junit(tmp_path / "junit.xml", header, [outcome], [1.5])
    suite = ET.parse(tmp_path / "junit.xml").getroot()[0]  # noqa: S314  # our own
    assert suite.attrib["name"].startswith("conformance of /dev/")
    assert (suite.attrib["failures"], len(suite)) == ("1", 1)
    assert "/dev/" in (tmp_path / "report.html").read_text(encoding="utf-8")
    assert json.loads((tmp_path / "record.json").read_text(encoding="utf-8"))["device"] == name


def test_the_headline_states_how_many_failed_and_the_worst_figure(tmp_path: Path) -> None:
    near, beyond = Measurement("speed", 9.0, "deg/s", 0.0, 10.0), Measurement("angle", 3.0, "deg", None, 2.0)
    first, second, *_ = chosen_cases(["5.2"])
    passed = Outcome(first, Verdict.MARGINAL, "", measurements=(near,))
    failed = Outcome(second, Verdict.FAIL, "too far", measurements=(beyond,))
    header = Header("port", load_profile(), 0, 0, [], "2026-11-28T17:00:00+00:00")
    for outcomes, headline in (
        ([passed], f"0 of 1 case failed. Nearest to its limit, in {first.id}: {near}."),
        ([passed, failed], f"1 of 2 cases failed. Farthest beyond its limit, in {second.id}: {beyond}."),
        ([Outcome(first, Verdict.PASS, "")], "0 of 1 case failed."),
    ):
        write_report(tmp_path / "report.html", header, outcomes, lambda _case: "", "conform --port port")
        report = (tmp_path / "report.html").read_text(encoding="utf-8")
        assert f">{headline}</p>" in report
        assert "2026-11-28T17:00:00+00:00 &middot; <code>conform --port port</code>" in report
