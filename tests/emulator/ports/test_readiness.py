"""Waiting for descriptors, including those with numbers too large for `select`."""

import fcntl
import os
import resource
import sys
from collections.abc import Iterator

import pytest

from emulator.ports.readiness import wait_for

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="pipes cannot be waited for there")

BEYOND_SELECT = 1500


@pytest.fixture(params=[0, BEYOND_SELECT], ids=["few descriptors", "many descriptors"])
def pipe(request: pytest.FixtureRequest) -> Iterator[tuple[int, int]]:
    """A pipe whose ends have at least the given numbers."""
    before = resource.getrlimit(resource.RLIMIT_NOFILE)
    if before[1] != resource.RLIM_INFINITY and before[1] < request.param + 10:
        pytest.skip("this system gives no so many descriptors")
    resource.setrlimit(resource.RLIMIT_NOFILE, (max(before[0], request.param + 10), before[1]))
    ends = os.pipe()
    reader, writer = (fcntl.fcntl(end, fcntl.F_DUPFD_CLOEXEC, request.param) for end in ends)
    for end in ends:
        os.close(end)
    yield reader, writer
    for end in (reader, writer):
        try:
            os.close(end)
        except OSError:
            continue
    resource.setrlimit(resource.RLIMIT_NOFILE, before)


def test_what_can_be_read_and_written_is_told(pipe: tuple[int, int]) -> None:
    reader, writer = pipe
    assert wait_for([reader], [], 0.0) == (set(), set())
    assert wait_for([reader], [writer], 5.0) == (set(), {writer})
    os.write(writer, b"x")
    assert wait_for([reader], [writer], 5.0) == ({reader}, {writer})


def test_an_end_can_be_read(pipe: tuple[int, int]) -> None:
    reader, writer = pipe
    os.close(writer)
    assert wait_for([reader], [], 5.0) == ({reader}, set())
