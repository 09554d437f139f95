"""The fixture and the suite as other people's projects use them."""

import os
import subprocess
import sys
import textwrap
from pathlib import Path

import pytest

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
        "protocol.conformance.pytest_plugin",
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


def test_the_suite_runs_under_pytest(tmp_path: Path) -> None:
    result = run_pytest(tmp_path, "--pyargs", "protocol.conformance", "-k", "5.3 or 5.4")
    assert "5 passed, 2 skipped" in result.stdout, result.stdout + result.stderr


@pytest.mark.parametrize(("port", "sentence"), [("loop://", "say --table-yes"), ("/dev/none", "cannot open /dev/none")])
def test_what_cannot_be_tested_ends_the_run_with_status_2(port: str, sentence: str, tmp_path: Path) -> None:
    result = run_pytest(tmp_path, "--pyargs", "protocol.conformance", "--table-port", port)
    assert result.returncode == 2
    assert sentence in result.stdout + result.stderr


def test_a_run_that_asks_for_nothing_imports_nothing(tmp_path: Path) -> None:
    (tmp_path / "test_other.py").write_text(
        "import sys\n\n"
        "def test_nothing_was_loaded():\n"
        "    loaded = {'serial', 'hypothesis', 'emulator', 'protocol.conformance.rig'} & sys.modules.keys()\n"
        "    assert not loaded\n"
    )
    result = run_pytest(tmp_path, "-p", "no:hypothesispytest")
    assert "1 passed" in result.stdout, result.stdout
