"""A plug-in for pytest: the fixture `rotary_table` for any tests, and the options of the conformance suite.

Every run of pytest loads it if this package is installed. It imports no module of this project before a test uses the
fixture, so that a project may have packages with the same names.
"""

from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from seventh_axis.home import hidden, hidden_library

if TYPE_CHECKING:
    from protocol.conformance.pytest.fixture import RotaryTable

IN_PROCESS = "emulator://"
PTY = "pty"


def pytest_addoption(parser: pytest.Parser) -> None:
    """Add the options of the table under test."""
    add = parser.getgroup("rotary table").addoption
    add(
        "--table-port",
        metavar="URL",
        default=IN_PROCESS,
        help="the table for the fixture rotary_table and for the conformance suite: a device, a URL of pyserial's, or "
        f"`{PTY}` for a fresh emulator on a pseudo-terminal (default: {IN_PROCESS}, in process and in simulated time)",
    )
    add("--table-profile", metavar="FILE", type=Path, help="TOML file with the properties of the table")
    add("--table-control", metavar="PATH", type=Path, help="the control channel of the emulator at the port")
    add("--table-yes", action="store_true", help="a real table may be moved within the limits of the profile")


@pytest.fixture
def rotary_table_port(pytestconfig: pytest.Config) -> str:
    """The port of `rotary_table`, from `--table-port`. A module that needs another port overrides this fixture."""
    return str(pytestconfig.getoption("--table-port"))


@pytest.fixture
def rotary_table(
    rotary_table_port: str, pytestconfig: pytest.Config, tmp_path_factory: pytest.TempPathFactory
) -> Iterator["RotaryTable"]:
    """A new table for each test: `.client` is a client, `.url` opens it, `.trigger()` is the probe."""
    ours = ("protocol", "emulator") if rotary_table_port.startswith(IN_PROCESS) else ("protocol",)
    if clash := next(filter(None, map(hidden, ours)), "") or hidden_library("serial", "pyserial"):
        pytest.fail(f"rotary_table: {clash}", pytrace=False)
    from protocol.conformance.pytest.fixture import RotaryTable, pty_emulator  # noqa: PLC0415 - see the module's docstring

    control = pytestconfig.getoption("--table-control")
    with ExitStack() as stack:
        url = rotary_table_port
        if url == PTY:
            url, control = stack.enter_context(pty_emulator(tmp_path_factory.mktemp("table")))
        yield stack.enter_context(RotaryTable(url, control, pytestconfig.getoption("--table-profile")))
