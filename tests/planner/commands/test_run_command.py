"""`run` and `show` from the command line: in virtual time, on a real pty and over TCP, and with bad input."""

import json
import re
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

from planner.__main__ import main
from tests.planner.run_examples import LOCATIONS, write_short_scan


@contextmanager
def running(command: list[str]) -> Iterator[str]:
    """Run a program, yield its first line, and end it."""
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True) as process:
        assert process.stdout is not None
        try:
            yield process.stdout.readline().strip()
        finally:
            process.terminate()


@pytest.fixture
def plan_file(tmp_path: Path) -> Path:
    return write_short_scan(tmp_path)


def run(plan_file: Path, out: Path, port: str = "emulator://", *options: str) -> int:
    return main(["run", str(plan_file), "--port", port, "--out", str(out), *options])


def result_in(out: Path) -> dict[str, Any]:
    document: dict[str, Any] = json.loads((out / "run.json").read_text(encoding="utf-8"))
    return document


def test_a_run_is_verified_and_leaves_its_files(
    plan_file: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "run"
    assert run(plan_file, out) == 0
    shown = capsys.readouterr()
    assert shown.out.startswith("verified: within 0.")
    said = re.fullmatch(r"(.*) s of table time in (.*) s: (.*) times real time\nthe report is .+\n", shown.err)
    assert said is not None
    table_s, wall_s, times_real = map(float, said.groups())
    assert table_s == pytest.approx(result_in(out)["commands"][-1]["time_s"], abs=3.0)
    assert table_s == pytest.approx(times_real * wall_s, rel=0.1, abs=0.01 * times_real)
    names = {file.name for file in out.iterdir()}
    assert names == {"run.json", "run.csv", "run.png", "plan.json", "map.npz", "robot.csv", "robot.json", "report.html"}
    assert result_in(out)["verified"]
    assert len(json.loads((out / "robot.json").read_text())["latched"]) == LOCATIONS


def test_the_same_run_gives_the_same_bytes(plan_file: Path, tmp_path: Path) -> None:
    for name in ("first", "second"):
        assert run(plan_file, tmp_path / name) == 0
    for name in ("run.json", "run.csv", "run.png", "robot.csv", "robot.json"):
        assert (tmp_path / "first" / name).read_bytes() == (tmp_path / "second" / name).read_bytes()


def test_a_tolerance_that_is_not_kept_is_a_negative_verdict(
    plan_file: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(plan_file, tmp_path / "run", "emulator://", "--tolerance", "0.001") == 1
    assert capsys.readouterr().out.startswith("deviated: ")


def test_run_and_show_write_one_page_with_everything_in_it(plan_file: Path, tmp_path: Path) -> None:
    out = tmp_path / "run"
    run(plan_file, out)
    page = (out / "report.html").read_text(encoding="utf-8")
    assert main(["show", str(out), "--out", str(tmp_path / "shown.html")]) == 0
    shown = (tmp_path / "shown.html").read_text(encoding="utf-8")
    assert shown.partition("<footer>")[0] == page.partition("<footer>")[0]
    assert f"<code>python -m planner run {plan_file} " in page
    assert result_in(out)["conditions"]["begun"] is None  # in simulated time
    assert result_in(out)["verdict"] in page
    assert page.count('<svg role="img" aria-label="') == page.count("<svg") == 3
    assert not re.search("https?://(?!www.w3.org/)", page)
    sent = result_in(out)["commands"][3]["command"]
    assert f"<td>{sent['target_deg']:g}</td>" in page


@pytest.mark.parametrize(
    ("port", "sentence"),
    [
        ("/dev/no-such-device", "cannot open /dev/no-such-device"),
        ("loop://", "check power, cable and baud rate"),
    ],
)
def test_a_port_without_a_table_is_one_sentence(
    plan_file: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], port: str, sentence: str
) -> None:
    assert run(plan_file, tmp_path / "run", port, "--timeout", "0.05") == 2
    error = capsys.readouterr().err
    assert sentence in error
    assert error.count("\n") == 1


def test_a_silent_port_is_one_sentence(plan_file: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    with running([sys.executable, "-c", SILENT_SERVER]) as port:
        assert run(plan_file, tmp_path / "run", f"socket://127.0.0.1:{port}", "--timeout", "0.1") == 2
    assert "no reply" in capsys.readouterr().err


SILENT_SERVER = """
import socket, time
listener = socket.create_server(("127.0.0.1", 0))
print(listener.getsockname()[1], flush=True)
connection, _ = listener.accept()
time.sleep(20)
"""


def test_a_plan_for_a_faster_table_is_refused(
    plan_file: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    document = json.loads(plan_file.read_text())
    document["limits"]["speed_deg_s"] = 60.0
    plan_file.write_text(json.dumps(document))
    assert run(plan_file, tmp_path / "run") == 2
    assert "create a plan within the limits of the table" in capsys.readouterr().err


def test_a_folder_without_a_run_is_one_sentence(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["show", str(tmp_path)]) == 2
    shown = capsys.readouterr().err
    assert "run.json: cannot be read: No such file or directory; python -m planner run writes a folder" in shown


@pytest.mark.realtime
@pytest.mark.parametrize("where", ["--pty", "--tcp"])
def test_a_real_port_gets_the_same_commands_and_the_same_verdict(plan_file: Path, tmp_path: Path, where: str) -> None:
    control = tmp_path / "control"
    listen = [where] if where == "--pty" else [where, "0"]
    command = [sys.executable, "-m", "emulator", *listen, "--control", str(control)]
    with running(command) as port:
        status = run(plan_file, tmp_path / "real", port, "--control", str(control), "--tolerance", "0.5")
    assert status == 0
    assert run(plan_file, tmp_path / "virtual") == 0
    real, virtual = (result_in(tmp_path / name) for name in ("real", "virtual"))
    # On a busy machine a command may be late; the following ones are corrected.
    until_s = min([each["time_s"] for each in real["corrections"]], default=float("inf"))
    same = [two for two in zip(real["commands"], virtual["commands"], strict=True) if two[0]["time_s"] < until_s]
    assert all(one["command"] == other["command"] for one, other in same)
    assert real["verified"]
    assert not real["missing_triggers"]
    page = (tmp_path / "real" / "report.html").read_text(encoding="utf-8")
    assert f"&middot; {real['conditions']['begun']} &middot; <code>" in page
