"""Every file that a command reads, damaged in many ways: one line that names the file, and status 2."""

from collections.abc import Callable
from pathlib import Path

import pytest

import emulator.__main__
import planner.__main__
import protocol.conformance.__main__
import tools.identify
import tools.plot_trace
import tools.tune
from tests.planner.run_examples import write_short_scan

Command = Callable[[list[str]], int]
NESTED = 100_000
SCAN = """
[workpiece]
class = "cylinder"
diameter_mm = 100
height_mm = 100
[path]
time_step_s = 0.5
file = "{path}"
[cell]
{cell}
"""


def scan_with(folder: Path, path: str = "path.csv", cell: str = "") -> str:
    file = folder / "scan.toml"
    file.write_text(SCAN.format(path=path, cell=cell))
    (folder / "path.csv").write_text("0,0,200,0,180,0\n10,0,200,0,180,0\n")
    return str(file)


def planner_on(command: str) -> Callable[[Path, Path], tuple[Command, list[str]]]:
    return lambda file, out: (planner.__main__.main, [command, str(file), "--out", str(out)])


def path_file(file: Path, out: Path) -> tuple[Command, list[str]]:
    return planner.__main__.main, ["map", scan_with(file.parent, file.name), "--out", str(out)]


def arm_file(file: Path, out: Path) -> tuple[Command, list[str]]:
    cell = f'arm = "{file.name}"\nbodies = "viper_s650"'
    return planner.__main__.main, ["map", scan_with(file.parent, cell=cell), "--out", str(out)]


def bodies_file(file: Path, out: Path) -> tuple[Command, list[str]]:
    return planner.__main__.main, ["map", scan_with(file.parent, cell=f'bodies = "{file.name}"'), "--out", str(out)]


def plan_file(file: Path, out: Path) -> tuple[Command, list[str]]:
    return planner.__main__.main, ["run", str(file), "--port", "emulator://", "--out", str(out)]


def map_file(file: Path, out: Path) -> tuple[Command, list[str]]:
    plan = write_short_scan(file.parent)
    return planner.__main__.main, [
        "run", str(plan), "--map", str(file), "--port", "emulator://", "--out", str(out),
    ]  # fmt: skip


def run_folder(file: Path, _: Path) -> tuple[Command, list[str]]:
    return planner.__main__.main, ["show", str(file.parent)]


def table_config(file: Path, _: Path) -> tuple[Command, list[str]]:
    return emulator.__main__.main, ["--tcp", "127.0.0.1:0", "--config", str(file)]


def tuned_config(file: Path, out: Path) -> tuple[Command, list[str]]:
    return tools.tune.main, ["--config", str(file), "--out", str(out)]


def recording(file: Path, out: Path) -> tuple[Command, list[str]]:
    return tools.identify.main, ["fit", str(file), "--out", str(out.with_suffix(".toml"))]


def known_config(file: Path, out: Path) -> tuple[Command, list[str]]:
    sound = file.with_name("recording.csv")
    sound.write_text("time_s,position_deg\n")
    return tools.identify.main, ["fit", str(sound), "--config", str(file), "--out", str(out.with_suffix(".toml"))]


def profile(file: Path, out: Path) -> tuple[Command, list[str]]:
    main = protocol.conformance.__main__.main
    return main, ["--port", "emulator://", "--profile", str(file), "--out", str(out)]


def record(file: Path, _: Path) -> tuple[Command, list[str]]:
    return protocol.conformance.__main__.main, ["--port", "emulator://", "--replay", str(file)]


def trace(file: Path, out: Path) -> tuple[Command, list[str]]:
    return tools.plot_trace.main, [str(file), "--out", str(out.with_suffix(".png"))]


READERS = {
    "map scan.toml": ("scan_under_test.toml", planner_on("map")),
    "plan scan.toml": ("scan_under_test.toml", planner_on("plan")),
    "scan scan.toml": ("scan_under_test.toml", planner_on("scan")),
    "path.csv": ("path_under_test.csv", path_file),
    "path.json": ("path_under_test.json", path_file),
    "arm.toml": ("arm_under_test.toml", arm_file),
    "bodies.toml": ("bodies_under_test.toml", bodies_file),
    "plan.json": ("plan_under_test.json", plan_file),
    "map.npz": ("map_under_test.npz", map_file),
    "run.json": ("run.json", run_folder),
    "emulator --config": ("table_under_test.toml", table_config),
    "tune --config": ("table_under_test.toml", tuned_config),
    "identify fit trace.csv": ("trace_under_test.csv", recording),
    "identify fit --config": ("table_under_test.toml", known_config),
    "conformance --profile": ("profile_under_test.toml", profile),
    "conformance --replay": ("record_under_test.json", record),
    "plot_trace npz": ("trace_under_test.npz", trace),
    "plot_trace": ("trace_under_test.csv", trace),
}
DAMAGES: dict[str, bytes | None] = {
    "not there": None,
    "binary": bytes(range(256)) * 40,
    "UTF-16": "name = 1\n".encode("utf-16"),
    "deep list": b"a = " + b"[" * NESTED + b"]" * NESTED,
    "deep JSON": b"[" * NESTED + b"]" * NESTED,
    "deep table": b"a = " + b"{b=" * NESTED + b"1" + b"}" * NESTED,
    "5000 digits": b"name = " + b"9" * 5000,
    "5000 digits of JSON": b'{"format": ' + b"9" * 5000 + b"}",
    "5000 hexadecimal digits": b"name = 0x" + b"f" * 5000,
    "not a number": b"name = nan\n",
    "not a number of JSON": b'{"format": NaN}',
    "NUL": b"a,b\n1,\x002\n",
    "only a byte order mark": b"\xef\xbb\xbf",
    "one long line": b"1," * 200_000,
}


def status_of(command: Command, arguments: list[str]) -> int:
    try:
        return command(arguments)
    except SystemExit as ended:  # argparse
        return ended.code if isinstance(ended.code, int) else 1


@pytest.mark.parametrize("reader", READERS)
@pytest.mark.parametrize("damage", [*DAMAGES, "folder"])
def test_a_damaged_file_is_one_line_and_status_2(
    reader: str, damage: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    name, arguments_for = READERS[reader]
    file = tmp_path / "folder_under_test" / name
    file.parent.mkdir()
    if damage == "folder":
        file.mkdir()
    elif (content := DAMAGES[damage]) is not None:
        file.write_bytes(content)
    if reader == "emulator --config" and damage == "only a byte order mark":
        pytest.skip("an empty file of constants is a sound one; the table would run")
    if damage == "only a byte order mark" and reader in {
        "tune --config",
        "identify fit --config",
        "conformance --profile",
    }:
        pytest.skip("an empty file is a sound one: all defaults")
    command, arguments = arguments_for(file, tmp_path / "out")
    status = status_of(command, arguments)
    said = capsys.readouterr().err
    assert status == 2
    lines = [line for line in said.splitlines() if not line.startswith("usage:") and line.strip()]
    assert len(lines) == 1
    assert "Traceback" not in said
    assert (file.parent.name if name == "run.json" else name) in said
    assert len(said) < 1500
