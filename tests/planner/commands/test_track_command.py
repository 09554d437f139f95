"""`track` from the command line: for the scan's path and a program's, in virtual time and on a real pty."""

import json
import socket
import sys
import threading
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from planner.__main__ import main
from tests.planner.commands.test_run_command import running
from tests.planner.tracking.track_examples import CONFIGURATION, LOCATIONS, lines, locations, write_scan


@pytest.fixture
def scan_file(tmp_path: Path) -> Path:
    return write_scan(tmp_path)


def track(scan_file: Path, out: Path, *options: str, port: str = "emulator://") -> int:
    asked = ["track", str(scan_file), "--port", port, "--out", str(out), "--angles", "72", "--view", "8", "--arm-away"]
    return main([*asked, "--configuration", CONFIGURATION.label, *options])


def document_in(out: Path, name: str) -> dict[str, Any]:
    document: dict[str, Any] = json.loads((out / name).read_text(encoding="utf-8"))
    return document


@pytest.fixture
def by_stdin(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Iterator[Path]:
    """Yield a file that is stdin; what is written to it before it is read is what a program sends."""
    file = tmp_path / "poses"
    file.touch()
    with file.open("rb") as stream:
        monkeypatch.setattr(sys, "stdin", stream)
        yield file


def test_the_path_of_a_scan_is_tracked_verified_and_recorded(
    scan_file: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "track"
    assert track(scan_file, out) == 0
    shown = capsys.readouterr().out
    assert shown.startswith("verified: within 0.")
    assert f"tracked    {LOCATIONS} of {LOCATIONS} locations, receding, 8 columns in view" in shown
    names = {file.name for file in out.iterdir()}
    assert names == {
        "run.json", "run.csv", "run.png", "plan.json", "map.npz", "robot.csv", "robot.json", "report.html",
        "track.json", "track.png",
    }  # fmt: skip
    tracked = document_in(out, "track.json")
    assert tracked["locations"] == {"revealed": LOCATIONS, "reached": LOCATIONS}
    assert all(each["last_known"] <= each["location"] + 8 for each in tracked["moments"])
    assert all(each["rest"]["location"] <= each["last_known"] for each in tracked["moments"])
    assert tracked["price"]["tracked"] >= tracked["price"]["known"] > 0.0
    assert document_in(out, "run.json")["deviations"]["reference"]["at_locations_deg"] < 0.05
    page = (out / "report.html").read_text(encoding="utf-8")
    assert "price of not knowing" in page
    assert "data:image/png;base64," in page


def test_a_damaged_record_of_the_decisions_is_named(
    scan_file: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "track"
    assert track(scan_file, out) == 0
    (out / "track.json").write_text("{}", encoding="utf-8")
    assert main(["show", str(out)]) == 2
    assert "track.json: is damaged: KeyError" in capsys.readouterr().err


def test_the_motion_that_was_tracked_can_be_run_as_a_plan(scan_file: Path, tmp_path: Path) -> None:
    assert track(scan_file, tmp_path / "track") == 0
    plan = str(tmp_path / "track" / "plan.json")
    assert main(["run", plan, "--port", "emulator://", "--arm-away", "--out", str(tmp_path / "run")]) == 0


def test_locations_of_a_program_give_the_motion_of_the_same_path(
    scan_file: Path, tmp_path: Path, by_stdin: Path
) -> None:
    by_stdin.write_text("\n".join(lines(locations())) + "\n", encoding="utf-8")
    assert track(scan_file, tmp_path / "program", "--poses", "-") == 0
    assert track(scan_file, tmp_path / "path") == 0
    program, path = (document_in(tmp_path / name, "plan.json")["table"] for name in ("program", "path"))
    assert program["angles_deg"] == pytest.approx(path["angles_deg"], abs=1e-6)


def test_a_program_that_dies_leaves_the_table_at_rest_and_what_was_done_recorded(
    scan_file: Path, tmp_path: Path, by_stdin: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    by_stdin.write_text("\n".join(lines(locations()[:15], end=False)) + "\n", encoding="utf-8")
    out = tmp_path / "track"
    assert track(scan_file, out, "--poses", "-") == 2
    shown = capsys.readouterr()
    assert 'stopped: stdin: ended without the line "end", at 15 locations' in shown.out
    assert f"the data recorded so far is in {out}" in shown.err
    assert document_in(out, "plan.json")["table"]["speeds_deg_s"][-1] == 0.0
    assert document_in(out, "run.json")["forbidden_steps"] == []
    assert document_in(out, "track.json")["locations"]["reached"] <= 15


@pytest.mark.parametrize(
    ("bad", "message"),
    [
        ("[1, 2, 3, 4, 5, NaN]", "line 16: holds a value that is not a finite number"),
        ("[9e9, 0, 0, 0, 0, 0]", "line 16 is 9e+09 mm from the workpiece"),
        ("[4000, 0, 0, 0, 0, 0]", "location 15 has no table angle that is allowed"),
        ("hello", "line 16 holds 'hello', which is not JSON"),
    ],
)
def test_a_bad_location_on_the_way_is_named_in_one_line(
    scan_file: Path, tmp_path: Path, by_stdin: Path, capsys: pytest.CaptureFixture[str], bad: str, message: str
) -> None:
    path = lines(locations())
    by_stdin.write_text("\n".join([*path[:15], bad, *path[15:]]) + "\n", encoding="utf-8")
    assert track(scan_file, tmp_path / "track", "--poses", "-") == 2
    verdict = capsys.readouterr().out.splitlines()[0]
    assert verdict.startswith("stopped: ")
    assert message in verdict
    table = document_in(tmp_path / "track", "plan.json")["table"]
    halted = {wait["location"] for wait in table.get("waits", ())}
    assert table["speeds_deg_s"][-1] == 0.0 or len(table["speeds_deg_s"]) - 1 in halted


@pytest.mark.parametrize(
    ("sent", "options", "message"),
    [
        ([], (), 'stdin: ended without the line "end", at 0 locations'),
        (['"end"'], (), "the number of locations of the path is 0; it must be at least 2"),
        (["[4000, 0, 0, 0, 0, 0]", "[4001, 0, 0, 0, 0, 0]", '"end"'], (), "location 0 has no table angle"),
        ([], ("--poses", "tcp://192.0.2.1:5000"), "allowed are - for stdin and tcp://127.0.0.1:PORT"),
        ([], ("--poses", "tcp://127.0.0.1:0", "--wait", "0.1"), "no program connected within 0.1 s"),
        ([], ("--baud", "1200"), "a time step of 0."),
    ],
)
def test_what_cannot_begin_is_refused_in_one_line_and_nothing_moves(
    scan_file: Path,
    tmp_path: Path,
    by_stdin: Path,
    capsys: pytest.CaptureFixture[str],
    sent: list[str],
    options: tuple[str, ...],
    message: str,
) -> None:
    by_stdin.write_text("".join(line + "\n" for line in sent), encoding="utf-8")
    assert track(scan_file, tmp_path / "track", "--poses", "-", *options) == 2
    error = capsys.readouterr().err.splitlines()[-1]
    assert message in error
    assert not (tmp_path / "track" / "run.json").exists()


@pytest.mark.realtime
def test_on_a_pty_a_program_sends_in_bursts_with_a_stall_and_the_table_waits(scan_file: Path, tmp_path: Path) -> None:
    command = [sys.executable, "-m", "emulator", "--pty"]
    with running(command) as port, socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        number = probe.getsockname()[1]
        probe.close()

        def send() -> None:
            sent = lines(locations())
            for _ in range(100):
                try:
                    program = socket.create_connection(("127.0.0.1", number))
                    break
                except OSError:
                    time.sleep(0.05)
            with program:
                program.sendall("".join(f"{line}\n" for line in sent[:10]).encode())
                time.sleep(14.0)  # the way to the start takes up to 8 s
                program.sendall("".join(f"{line}\n" for line in sent[10:]).encode())
                time.sleep(0.5)

        threading.Thread(target=send, daemon=True).start()
        assert track(scan_file, tmp_path / "track", "--poses", f"tcp://127.0.0.1:{number}", port=port) == 0
    tracked, ran = document_in(tmp_path / "track", "track.json"), document_in(tmp_path / "track", "run.json")
    assert sum(wait["duration_s"] for wait in tracked["waits"]) > 1.0
    assert ran["forbidden_steps"] == []
    assert tracked["locations"]["reached"] == LOCATIONS
