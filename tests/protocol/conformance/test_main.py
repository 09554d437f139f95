"""The command line: records, reports, replays, exit statuses, and one clear line for each error."""

import itertools
import json
import os
import shlex
import subprocess
import sys
from pathlib import Path
from xml.etree import ElementTree as ET

import pytest

from emulator.protocol_emulator import Serial
from emulator.table.table import Table
from protocol.conformance.__main__ import main
from protocol.conformance.commands import suite_run

ROOT = Path(__file__).parents[3]
TOO_STRICT = "[tolerance]\nspeed_share = 0.0001\n"


def conformance(*words: str | Path) -> int:
    try:
        return main([str(word) for word in words])
    except SystemExit as ended:  # argparse
        return ended.code if isinstance(ended.code, int) else 1


@pytest.fixture
def out(tmp_path: Path) -> Path:
    return tmp_path / "out"


def test_a_run_leaves_a_record_a_report_and_junit(out: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert conformance("--port", "emulator://", "--case", "7.1/1", "--case", "5.4", "--out", out) == 0
    assert capsys.readouterr().out.endswith("2 pass, 2 skipped\n")
    record = json.loads((out / "record.json").read_text())
    assert record["verdicts"] == {"pass": 2, "skipped": 2}
    assert record["profile"]["limits"]["speed_deg_s"] == 40.0
    (case, *_) = [case for case in record["cases"] if case["id"] == "7.1/1"]
    assert case["clause"].startswith("A motion from rest accelerates at A")
    assert {"top speed", "acceleration"} <= {measurement["name"] for measurement in case["measurements"]}
    assert [way for _, way, _ in case["wire"][:2]] == ["sent", "received"]
    suite = ET.parse(out / "junit.xml").getroot()[0]  # noqa: S314 - our own file
    assert (suite.get("tests"), suite.get("failures"), suite.get("skipped")) == ("4", "0", "2")
    report = (out / "report.html").read_text()
    assert "<svg" in report
    assert "http" not in report  # one file, which asks for nothing
    assert sorted(path.name for path in out.iterdir()) == ["junit.xml", "record.json", "report.html"]


def test_junit_gives_the_real_seconds_of_a_simulated_table(out: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    times_s = itertools.count(step=0.25)

    class SlowClock:
        def now_s(self) -> float:
            return next(times_s)

    monkeypatch.setattr(suite_run, "WallClock", SlowClock)
    assert conformance("--port", "emulator://", "--case", "7.1/1", "--out", out) == 0
    suite = ET.parse(out / "junit.xml").getroot()[0]  # noqa: S314 - our own file
    assert (suite.get("time"), [case.get("time") for case in suite]) == ("0.500", ["0.250", "0.250"])
    assert min(case["seconds"] for case in json.loads((out / "record.json").read_text())["cases"]) > 2


def test_in_simulated_time_a_run_gives_the_same_bytes(tmp_path: Path) -> None:
    for name in ("one", "two"):
        conformance("--port", "emulator://", "--case", "7.3", "--out", tmp_path / name)
    assert (tmp_path / "one" / "record.json").read_bytes() == (tmp_path / "two" / "record.json").read_bytes()


def test_a_failure_says_which_clause_and_how_to_repeat_it(
    out: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    profile = tmp_path / "table.toml"
    profile.write_text(TOO_STRICT)
    words = ("--port", "emulator://", "--profile", profile, "--case", "7.1/1", "--seed", "3", "--out", out)
    assert conformance(*words) == 1
    printed = capsys.readouterr().out
    assert "fail      7.1/1:backwards: top speed" in printed
    assert "must: A motion from rest accelerates at A up to S" in printed
    again = next(line for line in printed.splitlines() if "To repeat: " in line and "7.1/1:backwards " in line)
    command = again.partition("To repeat: python ")[2].split()
    result = subprocess.run([sys.executable, *command], capture_output=True, text=True, check=False)
    assert result.returncode == 1
    assert "fail      7.1/1:backwards: top speed" in result.stdout
    assert ET.parse(out / "junit.xml").getroot()[0].get("failures") == "1"  # noqa: S314 - our own file


def test_the_command_that_repeats_a_case_repeats_no_other(
    out: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    profile = tmp_path / "table.toml"
    profile.write_text("[tolerance]\nacceleration_share = 0.0001\n")
    conformance("--port", "emulator://", "--profile", profile, "--case", "7.1/1", "--out", out)
    again = next(line for line in capsys.readouterr().out.splitlines() if "To repeat: " in line)
    words = shlex.split(again.partition("To repeat: python -m protocol.conformance ")[2])
    assert conformance(*words) == 1
    assert capsys.readouterr().out.endswith("\n1 fail\n")


def test_the_report_begins_with_what_failed(out: Path, tmp_path: Path) -> None:
    profile = tmp_path / "table.toml"
    profile.write_text(TOO_STRICT)
    conformance("--port", "emulator://", "--profile", profile, "--case", "7.1/1", "--out", out)
    report = (out / "report.html").read_text()
    first = report.index('<a href="#7.1/1:backwards"><code>7.1/1:backwards</code></a><span>top speed ')
    assert first < report.index("<h2>")
    assert 'href="#7.1/1"><code>' not in report  # it passed
    assert "2 of the suite" in report


def test_junit_goes_where_it_is_told_to(out: Path, tmp_path: Path) -> None:
    file = tmp_path / "reports" / "of today" / "table.xml"
    assert conformance("--port", "emulator://", "--case", "2.1/2", "--out", out, "--junit", file) == 0
    assert ET.parse(file).getroot()[0].get("tests") == "1"  # noqa: S314 - our own file
    assert not (out / "junit.xml").exists()


def test_a_place_that_is_no_directory_is_refused_before_the_run(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "file").write_text("precious")
    file, inside = str(tmp_path / "file"), str(tmp_path / "file" / "x.xml")
    for words in (["--out", file], ["--out", str(tmp_path), "--junit", inside]):
        assert conformance("--port", "emulator://", *words) == 2
        said = capsys.readouterr()
        assert said.out == ""
        assert f"{tmp_path / 'file'}: cannot create directory" in said.err
    assert (tmp_path / "file").read_text() == "precious"


def test_a_file_that_cannot_be_written_takes_none_of_the_others_with_it(
    out: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (out / "record.json").mkdir(parents=True)
    assert conformance("--port", "emulator://", "--case", "5.2/1$", "--out", out) == 2
    said = capsys.readouterr()
    assert said.out == "1 pass\n"
    assert said.err == f"conformance: {out / 'record.json'}: cannot write: Is a directory\n"
    assert sorted(path.name for path in out.iterdir()) == ["junit.xml", "record.json", "report.html"]


def test_a_reader_of_stdout_that_goes_away_costs_nothing_but_what_it_would_have_read(out: Path) -> None:
    reader, writer = os.pipe()
    os.close(reader)
    words = [sys.executable, "-m", "protocol.conformance", "--port", "emulator://", "--case", "5", "--out", str(out)]
    result = subprocess.run(words, stdout=writer, stderr=subprocess.PIPE, text=True, check=False)
    os.close(writer)
    assert (result.returncode, result.stderr) == (0, f"conformance: report: {out / 'report.html'}\n")
    assert json.loads((out / "record.json").read_text())["verdicts"]["skipped"] == 2


@pytest.mark.parametrize(
    ("words", "closed", "status", "said"),
    [
        ("--port emulator:// --case 5.4 --out out", "2>&-", 0, "2 skipped\n"),
        ("--port emulator:// --case 5.4 --out out", ">&-", 0, "conformance: report: out/report.html\n"),
        ("--port loop:// --case 5.4 --out out", "<&- >&-", 2, "deg/s2; add --yes to allow this\n"),
    ],
)
def test_a_stream_that_is_closed_from_the_start_is_done_without(
    words: str, closed: str, status: int, said: str, tmp_path: Path
) -> None:
    command = f"exec {sys.executable} -m protocol.conformance {words} {closed}"
    environment = os.environ | {"PYTHONPATH": str(ROOT)}
    result = subprocess.run(
        ["sh", "-c", command], cwd=tmp_path, env=environment, capture_output=True, text=True, check=False
    )
    assert result.returncode == status
    assert (result.stdout + result.stderr).endswith(said)


def test_the_list_shows_clauses_and_needs(capsys: pytest.CaptureFixture[str]) -> None:
    assert conformance("--list", "--case", "6.2/1") == 0
    line = capsys.readouterr().out
    assert line.startswith("6.2/1 ")
    assert "must" in line
    assert "[turns 40 deg]  [needs a trigger input that the rig can drive]" in line


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (["--port", "emulator://"], "give --port URL and --out DIR"),
        (["--port", "emulator://", "--out", "OUT", "--case", "12"], "--case: no case id starts with 12"),
        (["--port", "emulator://", "--out", "OUT", "--case", ""], "--case: a prefix is empty; omit the option"),
        (["--port", "emulator://", "--out", "OUT", "--junit", "/"], "--junit /: is a directory; name a file"),
        (
            ["--port", "emulator://", "--out", "/x", "--junit", "/x/record.json"],
            "is another output file of --out; choose",
        ),
        (["--port", "/dev/no-such-table", "--out", "OUT"], "cannot open /dev/no-such-table"),
        (
            ["--port", "loop://", "--out", "OUT", "--yes"],
            "loop://: 'H' got b'H\\r', which is not a position; this is not",
        ),
        (["--port", "loop://", "--out", "OUT"], "deg/s2; add --yes to allow this"),
        (["--port", "emulator://", "--out", "OUT", "--profile", "none.toml"], "none.toml: cannot be read"),
        (["--port", "emulator://", "--out", "OUT", "--control", "none"], "none: "),
        (["--port", "emulator://", "--replay", "none.json"], "none.json: cannot be read"),
        (["--nonsense"], "unrecognized arguments: --nonsense"),
    ],
)
def test_what_cannot_be_done_is_one_clear_line(
    words: list[str], sentence: str, out: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert conformance(*(str(out) if word == "OUT" else word for word in words)) == 2
    said = capsys.readouterr().err
    assert sentence in said
    assert said.count("\n") == 1


# Replay


@pytest.fixture
def record(tmp_path: Path) -> Path:
    conformance(
        "--port", "emulator://", "--case", "4.5/4", "--case", "5.2", "--case", "6.2/2", "--out", tmp_path / "recorded"
    )
    return tmp_path / "recorded" / "record.json"


def test_a_record_sent_to_a_like_table_gets_the_same_answers(record: Path, capsys: pytest.CaptureFixture[str]) -> None:
    capsys.readouterr()
    assert conformance("--port", "emulator://?seed=9", "--replay", record) == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[-1].endswith(" cases compared, 0 differ")
    assert {line.split()[0] for line in lines[:-1]} == {"same"}


def test_a_record_sent_to_another_table_shows_where_the_answers_part(
    record: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "recorded" / "record.json"
    changed = json.loads(file.read_text())
    case = next(case for case in changed["cases"] if case["id"] == "4.5/4")
    index = next(i for i, (_, way, data) in enumerate(case["wire"]) if (way, data) == ("received", "OK\r"))
    case["wire"][index][2] = "ERR 3 out of range\r"
    file.write_text(json.dumps(changed))
    capsys.readouterr()
    assert conformance("--port", "emulator://", "--replay", record, "--case", "4.5/4") == 1
    assert "parts     4.5/4: at 0.0" in (printed := capsys.readouterr().out)
    assert "recorded b'ERR 3 out of range', now b'OK'" in printed
    assert printed.endswith("1 cases compared, 1 differ\n")


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        ({"version": 2}, "has version 2; this program reads version 1"),
        ({"format": "a shopping list"}, "is not a seventh-axis conformance record"),
        ({"cases": [{}]}, "is damaged: KeyError 'id'"),
        ({"version": "1"}, "has version '1'; this program reads version 1"),
        ({"cases": []}, "contains no traffic of these cases; choose other cases"),
        ({"cases": [{"id": "0.0/0", "wire": [[0, "sent", "H\r"]]}]}, "contains no traffic of these cases"),
        (
            {"cases": [{"id": "4.5/4", "wire": [["soon", "sent", "H\r"]]}]},
            "is damaged: ValueError 'soon' is not a time",
        ),
        (
            {"cases": [{"id": "4.5/4", "wire": [[0, "shouted", "H\r"]]}]},
            "'shouted' is not one of sent, received, beside",
        ),
        ({"cases": [{"id": "4.5/4", "wire": [[0, "beside", "kick"]]}]}, "'kick' is not an action of the rig"),
        ({"cases": [{"id": "4.5/4", "wire": [[10**400, "sent", "H\r"]]}]}, "is damaged: OverflowError"),
        ({"home_deg": 10**400}, "is damaged: OverflowError"),
        ({"home_deg": float("inf")}, "Infinity is not a number"),
        ({"home_deg": 90}, "the record began at 90; bring it there first"),
    ],
)
def test_a_record_that_cannot_be_sent_is_refused_in_one_line(
    change: dict[str, object], sentence: str, record: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    record.write_text(json.dumps(json.loads(record.read_text()) | change))
    capsys.readouterr()
    assert conformance("--port", "emulator://", "--replay", record) == 2
    assert sentence in capsys.readouterr().err


def test_a_record_of_a_livelier_table_is_not_sent(
    record: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    profile = tmp_path / "careful.toml"
    profile.write_text("[motion]\nspeed_deg_s = 5\n")
    assert conformance("--port", "emulator://", "--profile", profile, "--replay", record) == 2
    assert "was recorded with motion.speed_deg_s 40; the profile allows 5" in capsys.readouterr().err


def hostile(record: Path, *lines: str) -> None:
    """Let a record contain the mildest profile, and hide other lines in its first case."""
    changed = json.loads(record.read_text())
    changed["profile"]["motion"] = {"reach_deg": 1.0, "speed_deg_s": 1.0, "acceleration_deg_s2": 1.0}
    case = next(case for case in changed["cases"] if case["wire"])
    case["wire"] = [[float(index), "sent", line] for index, line in enumerate(lines)]
    changed["cases"] = [case]
    record.write_text(json.dumps(changed))


@pytest.mark.parametrize(
    ("lines", "named"),
    [
        (["S 40\r", "A 10\r", "P 2999.998\r"], "b'S 40' of case"),
        (["S 2\r", "A 10\r", "P 2999.998\r"], "b'P 2999.998' of case"),
        (["S 2\r", "A 10\r", *["R 4.9\r"] * 9], "b'R 4.9' of case"),
        (["S 2\r", "A 10\r", "p 3000\r"], "b'p 3000' of case"),
    ],
)
def test_a_record_that_hides_a_motion_is_refused_before_anything_is_sent(
    lines: list[str],
    named: str,
    record: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    hostile(record, *lines)
    profile = tmp_path / "careful.toml"
    profile.write_text("[motion]\nreach_deg = 5\nspeed_deg_s = 2\nacceleration_deg_s2 = 10\n")
    written: list[bytes] = []
    monkeypatch.setattr(Serial, "write", lambda _, data: written.append(bytes(data)))
    capsys.readouterr()
    assert conformance("--port", "emulator://", "--profile", profile, "--replay", record) == 2
    said = capsys.readouterr().err
    assert named in said
    assert said.count("\n") == 1
    assert written == []


def test_a_replay_ends_when_a_table_has_carried_out_what_it_must_refuse(
    record: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """A table that accepts lowercase letters is moved by a line that fits, and the next case would start elsewhere."""
    changed = json.loads(record.read_text())
    names = [case["id"] for case in changed["cases"] if case["wire"]][:2]
    changed["cases"] = [
        {"id": names[0], "wire": [[0.0, "sent", "p 30\r"], [9.0, "sent", "H\r"]]},
        {"id": names[1], "wire": [[0.0, "sent", "R 380\r"]]},
    ]
    record.write_text(json.dumps(changed))
    receive = Table.receive
    monkeypatch.setattr(Table, "receive", lambda table, data: receive(table, data.replace(b"p", b"P")))
    capsys.readouterr()
    assert conformance("--port", "emulator://", "--replay", record) == 2
    assert f"before case {names[1]} the table is at 30 deg and should be at 0" in capsys.readouterr().err
