import json
import shlex
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import pytest

from emulator.config.table_config import load_config
from tools.tune import main


def test_the_command_line_writes_gains_header_report_and_plots(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    status = main(["--plants", "20", "--out", str(tmp_path / "out")])

    assert status == 0
    names = {path.name for path in (tmp_path / "out").iterdir()}
    assert names == {
        "gains.toml",
        "gains.h",
        "figures.json",
        "report.html",
        "answers.svg",
        "bode.svg",
        "nyquist.svg",
        "spread.svg",
    }
    assert "ramp set: K " in capsys.readouterr().out
    load_config(tmp_path / "out" / "gains.toml")
    report = (tmp_path / "out" / "report.html").read_text(encoding="utf-8")
    assert report.count("<svg") == 4
    assert "src=" not in report  # nothing is loaded from elsewhere


def judged(gains: str, folder: Path, *options: str) -> tuple[int, dict[str, Any]]:
    """Judge gains given as TOML; return the exit status and the figures."""
    path = folder / "gains.toml"
    path.write_text(gains, encoding="utf-8")
    status = main(["--judge", str(path), "--plants", "10", "--out", str(folder / "out"), *options])
    return status, json.loads((folder / "out" / "figures.json").read_text(encoding="utf-8"))


def test_gains_that_keep_all_bounds_are_judged_with_status_0(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    status, figures = judged("[gains.hold]\nproportional_duty_s_deg = 0.016\n", tmp_path, "--noise", "5")

    assert status == 0
    assert figures["all_bounds_hold"] is True
    assert figures["sets"]["hold"]["after"]["proportional_duty_s_deg"] == pytest.approx(0.016, rel=1e-4)
    assert all(bound["holds"] for each in figures["sets"].values() for bound in each["bounds"].values())
    assert figures["checks"]["load_step"]["load_peak_deg_s"]["after"]["emulator"] > 0.1
    assert "Both sets satisfy all bounds" in capsys.readouterr().out
    assert load_config(tmp_path / "out" / "gains.toml").gains.hold.proportional_duty_s_deg == pytest.approx(0.016)


def test_gains_that_break_bounds_are_reported_in_full_with_status_1(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    wild = "[gains.ramp]\nproportional_duty_s_deg = 0.2\n[gains.hold]\nproportional_duty_s_deg = 0.004\n"

    status, figures = judged(wild, tmp_path)

    assert status == 1
    assert figures["all_bounds_hold"] is False
    assert [figures["sets"][name]["stable"] for name in ("ramp", "hold")] == [False, True]
    assert figures["sets"]["hold"]["bounds"]["bandwidth_hz"]["holds"] is False
    assert figures["sets"]["hold"]["bounds"]["sensitivity_peak"]["holds"] is True
    assert figures["checks"]["ramp"]["ramp_lag_deg_s"]["after"]["model"] is None
    report = (tmp_path / "out" / "report.html").read_text(encoding="utf-8")
    assert "Not all bounds are satisfied: the ramp set is not stable; the constant-speed set breaks " in report
    assert report.count("<svg") == 4
    assert "Not all bounds are satisfied" in capsys.readouterr().out


def test_the_judged_file_is_not_overwritten(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "gains.toml"
    path.write_text("[gains.hold]\nproportional_duty_s_deg = 0.016  # mine\n", encoding="utf-8")

    assert main(["--judge", str(path), "--out", str(tmp_path)]) == 2
    assert capsys.readouterr().err == f"tune: {path} would be overwritten; --out must be another folder\n"
    assert path.read_text(encoding="utf-8").endswith("# mine\n")


@pytest.mark.parametrize(
    ("options", "complaint"),
    [
        (["--ms", "1"], "--ms is 1; it must be a number greater than 1"),
        (["--ms", "nan"], "--ms is nan; it must be a number greater than 1"),
        (["--noise", "0"], "--noise is 0; it must be a number greater than 0"),
        (["--settling", "inf"], "--settling is inf; it must be a number greater than 0"),
        (["--plants", "0"], "--plants is 0; it must be at least 1"),
        (["--spread", "nan"], "--spread is nan; it must be at least 0 and less than 100 %"),
        (["--seed", "-1"], "--seed is -1; it must be at least 0"),
        (["--config", "/nowhere/table.toml"], "/nowhere/table.toml: cannot be read"),
        (["--judge", "/nowhere/gains.toml"], "/nowhere/gains.toml: cannot be read"),
    ],
)
def test_what_cannot_be_done_is_said_in_one_line(
    options: list[str], complaint: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    status = main([*options, "--out", str(tmp_path / "out")])

    message = capsys.readouterr().err
    assert status == 2
    assert complaint in message
    assert message.count("\n") == 1
    assert not (tmp_path / "out").exists()


def test_where_no_gains_keep_all_bounds_a_report_is_written_and_the_printed_command_line_works(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Both sets are judged, so one command line is enough."""
    out = tmp_path / "a folder"

    status = main(["--bandwidth", "60", "--plants", "3", "--out", str(out)])

    message = capsys.readouterr().err
    assert status == 2
    assert {path.name for path in out.iterdir()} >= {"report.html", "answers.svg"}
    assert not (out / "gains.toml").exists()
    report = (out / "report.html").read_text(encoding="utf-8")
    assert "No gains satisfy all bounds: the ramp set breaks " in report
    assert "the constant-speed set breaks " in message
    words = shlex.split(message.partition("this works: ")[2])
    assert words[:3] == ["python", "-m", "tools.tune"]
    assert main(words[3:]) == 0
    assert (out / "gains.toml").exists()


@pytest.mark.parametrize(
    ("constants", "key"),
    [
        ("[motor]\nresistance_ohm = -1.0\n", "motor.resistance_ohm"),
        ("[table]\ninertia_kg_m2 = 0.0\n", "table.inertia_kg_m2"),
        ("[gears]\nefficiency = 1.2\n", "gears.efficiency"),
        ("[control]\ntick_hz = 0\n", "control.tick_hz"),
        ("[limits]\nspeed_deg_s = 1e6\n", "limits.speed_deg_s"),
    ],
)
def test_an_impossible_constant_is_named_by_its_key(
    constants: str, key: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "table.toml"
    path.write_text(constants, encoding="utf-8")

    status = main(["--config", str(path), "--out", str(tmp_path / "out")])

    message = capsys.readouterr().err
    assert status == 2
    assert f"{path}: {key} is" in message
    assert message.count("\n") == 1


def test_a_folder_that_cannot_be_made_is_refused_before_the_work(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "file").write_text("", encoding="utf-8")

    status = main(["--out", str(tmp_path / "file" / "out")])

    assert status == 2
    assert capsys.readouterr().err == f"tune: {tmp_path / 'file'} is not a folder\n"


@pytest.mark.skipif(not hasattr(signal, "SIGINT") or sys.platform == "win32", reason="there is no Ctrl-C to send")
def test_an_interrupt_ends_with_130_and_leaves_nothing(tmp_path: Path) -> None:
    with subprocess.Popen(
        [sys.executable, "-c", "import tools.tune as t, sys; print('on', flush=True); sys.exit(t.main())",
         "--plants", "100000", "--out", str(tmp_path / "out")],
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
    ) as process:  # fmt: skip
        assert process.stdout is not None
        assert process.stdout.readline() == "on\n"
        time.sleep(1.0)
        process.send_signal(signal.SIGINT)
        _, errors = process.communicate(timeout=60.0)

    assert process.returncode == 130
    assert errors == "tune: interrupted\n"
    assert not list(tmp_path.iterdir())
