"""The fixture and the suite in other projects."""

import os
import shlex
import socket
import subprocess
import sys
import textwrap
import threading
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from xml.etree import ElementTree as ET

import pytest

from protocol.conformance.cases.catalog import all_cases

ROOT = Path(__file__).parents[3]


def run_pytest(folder: Path, *words: str) -> subprocess.CompletedProcess[str]:
    command = [
        sys.executable,
        "-m",
        "pytest",
        "-q",
        "-p",
        "no:cacheprovider",
        "-p",
        "seventh_axis.pytest_plugin",
    ]
    environment = os.environ | {"PYTHONPATH": str(ROOT)}
    return subprocess.run(
        [*command, *words], cwd=folder, env=environment, capture_output=True, text=True, check=False, timeout=120
    )


@pytest.fixture
def project(tmp_path: Path) -> Path:
    (tmp_path / "test_scanner.py").write_text(
        textwrap.dedent("""
        def test_a_table_is_fresh(rotary_table):
            table = rotary_table.client
            assert table.position_deg() == 0
            table.set_speed(40)
            table.move_to(2)
            table.wait_until_at(2)
            rotary_table.trigger()
            assert abs(table.latched_deg() - 2) < 0.1

        def test_so_is_the_next(rotary_table):
            assert rotary_table.client.position_deg() == 0
            assert rotary_table.profile.limits.speed_deg_s == 40
        """)
    )
    return tmp_path


def test_the_fixture_gives_a_fresh_table_in_process(project: Path) -> None:
    result = run_pytest(project)
    assert "2 passed" in result.stdout, result.stdout + result.stderr


@pytest.mark.realtime
def test_the_fixture_gives_a_fresh_table_on_a_pty(project: Path) -> None:
    result = run_pytest(project, "--table-port", "pty")
    assert "2 passed" in result.stdout, result.stdout + result.stderr


def test_a_port_that_cannot_be_opened_fails_the_test_in_one_line(project: Path) -> None:
    result = run_pytest(project, "--table-port", "/dev/no-such-table")
    assert "2 failed" in result.stdout
    assert "cannot open /dev/no-such-table" in result.stdout


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (["--table-profile", "none.toml"], "none.toml: cannot be read"),
        (["--table-control", "none"], "is this the --control socket of a running emulator?"),
    ],
)
def test_what_the_fixture_cannot_use_fails_the_test_in_one_line(words: list[str], sentence: str, project: Path) -> None:
    result = run_pytest(project, "-k", "fresh", *words)
    assert sentence in result.stdout
    assert "Error" not in result.stdout.partition("short test summary")[0]  # no traceback through this package


def test_the_suite_runs_under_pytest(tmp_path: Path) -> None:
    words = ["--pyargs", "protocol.conformance", "-k", "5.3 or 5.4 or 4.3/2", "--junitxml", "junit.xml", "-W", "error"]
    result = run_pytest(tmp_path, *words)
    assert "6 passed, 2 skipped" in result.stdout, result.stdout + result.stderr
    assert "warning" not in result.stdout
    suite = ET.parse(tmp_path / "junit.xml").getroot()[0]  # noqa: S314 - our own file
    assert "4.3/2: latch" in {one.get("name") for one in suite.iter("property")}
    assert not suite.findall("testcase/properties")  # which xunit2, that pytest writes, does not have


@pytest.mark.realtime
def test_the_suite_starts_a_pty_emulator_under_pytest(tmp_path: Path) -> None:
    result = run_pytest(tmp_path, "--pyargs", "protocol.conformance", "--table-port", "pty", "-k", "5.3 or 6.2/2")
    assert "7 passed" in result.stdout, result.stdout + result.stderr


def test_a_failure_under_pytest_ends_with_the_command_that_repeats_it_alone(tmp_path: Path) -> None:
    (tmp_path / "table.toml").write_text("[tolerance]\nacceleration_share = 0.0001\n")
    words = ["--pyargs", "protocol.conformance", "--table-profile", "table.toml", "-k", "7.1/1"]
    result = run_pytest(tmp_path, *words)
    assert "2 failed" in result.stdout
    # the first such line: where pytest finds the variable CI, its closing summary repeats each failure whole
    again = next(line for line in result.stdout.splitlines() if line.startswith("To repeat: pytest "))
    result = run_pytest(tmp_path, *shlex.split(again)[3:])
    assert f"1 failed, {len(all_cases()) - 1} deselected" in result.stdout
    assert "test_clause[7.1/1]" in result.stdout


@pytest.fixture
def hang_up() -> Iterator[str]:
    """A TCP server that disconnects every client."""
    with socket.create_server(("127.0.0.1", 0)) as server:

        def serve() -> None:
            with suppress(OSError):
                while True:
                    server.accept()[0].close()

        thread = threading.Thread(target=serve)
        thread.start()
        yield f"socket://127.0.0.1:{server.getsockname()[1]}"
        server.shutdown(socket.SHUT_RDWR)
        thread.join()


@pytest.mark.parametrize(
    ("port", "sentence"),
    [
        ("loop://", "each way from where it stands, at up to 40 deg/s and 100 deg/s2; add --table-yes to allow this"),
        ("/dev/none", "cannot open /dev/none"),
    ],
)
def test_what_cannot_be_tested_ends_the_run_with_status_2(port: str, sentence: str, tmp_path: Path) -> None:
    result = run_pytest(tmp_path, "--pyargs", "protocol.conformance", "--table-port", port)
    assert result.returncode == 2
    assert sentence in result.stdout + result.stderr


def test_a_port_that_hangs_up_ends_the_run_with_status_2(hang_up: str, tmp_path: Path) -> None:
    words = ["--pyargs", "protocol.conformance", "--table-port", hang_up, "--table-yes", "-W", "error"]
    result = run_pytest(tmp_path, *words)
    assert result.returncode == 2, result.stdout + result.stderr
    assert f"{hang_up}: the port failed: " in result.stdout + result.stderr


def test_a_run_that_asks_for_nothing_imports_nothing(tmp_path: Path) -> None:
    (tmp_path / "test_other.py").write_text(
        "import sys\n\n"
        "def test_nothing_was_loaded():\n"
        "    loaded = {'serial', 'hypothesis', 'emulator', 'protocol.conformance.judgement.rig'} & sys.modules.keys()\n"
        "    assert not loaded\n"
    )
    result = run_pytest(tmp_path, "-p", "no:hypothesispytest")
    assert "1 passed" in result.stdout, result.stdout
