"""A program's pipe or connection as a source of locations, with what goes wrong there."""

import os
import socket
import sys
from collections.abc import Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import ExitStack
from pathlib import Path

import pytest

from planner.tracking.pose_lines import SourceError
from planner.tracking.pose_source import ProgramSource, program_source
from tests.planner.tracking.track_examples import lines, locations


@pytest.fixture
def pipe() -> Iterator[tuple[int, int]]:
    """Yield the ends of a pipe, that to read and that to write."""
    ends = os.pipe()
    yield ends
    for end in ends:
        os.close(end)


def quiet(_: str) -> None:
    """Print nothing."""


def test_no_more_is_taken_than_there_is_room_for(pipe: tuple[int, int]) -> None:
    source = ProgramSource(pipe[0], "poses")
    os.write(pipe[1], ("\n".join(lines(locations(5))) + "\n").encode())
    taken = [len(source.take(2)) for _ in range(3)]
    assert taken == [2, 2, 1]
    assert source.has_ended


@pytest.mark.parametrize("behind", ['"end"', "[1, 2, 3, 4, 5, 6]", "hello"])
def test_what_follows_the_end_is_a_fault_even_if_all_locations_were_taken(pipe: tuple[int, int], behind: str) -> None:
    source = ProgramSource(pipe[0], "poses")
    os.write(pipe[1], "\n".join([*lines(locations(3)), behind, ""]).encode())
    assert len(source.take(3)) == 3
    assert not source.has_ended
    with pytest.raises(SourceError, match='line 5 comes after "end"'):
        source.take(3)


@pytest.mark.parametrize("is_there", [False, True])
def test_a_stdin_that_is_closed_is_named(monkeypatch: pytest.MonkeyPatch, is_there: bool) -> None:
    with Path(os.devnull).open(encoding="utf-8") as stdin:
        pass
    monkeypatch.setattr(sys, "stdin", stdin if is_there else None)
    with pytest.raises(SourceError, match="poses: stdin is closed"), program_source("-", quiet, 1.0):
        pass


def test_a_second_program_is_refused_and_what_the_first_leaves_unfinished_is_named() -> None:
    with ThreadPoolExecutor(1) as threads:
        connected: list[Future[socket.socket]] = []
        numbers: list[int] = []

        def announced(line: str) -> None:
            numbers.append(int(line.rpartition(":")[2]))
            connected.append(threads.submit(socket.create_connection, ("127.0.0.1", numbers[0])))

        with program_source("tcp://127.0.0.1:0", announced, 10.0) as source, connected[0].result() as program:
            with pytest.raises(ConnectionRefusedError):
                socket.create_connection(("127.0.0.1", numbers[0]), timeout=5.0)
            program.sendall(b"[1, 2, 3, 4, 5, 6]\n[1, 2, 3")
            program.close()
            assert len(source.take(1, 5.0)) == 1
            with pytest.raises(SourceError, match=r"line 2 holds '\[1, 2, 3', which is not JSON"):
                source.take(1, 5.0)


def test_a_port_in_use_is_named() -> None:
    with socket.create_server(("127.0.0.1", 0)) as other:
        name = f"tcp://127.0.0.1:{other.getsockname()[1]}"
        with pytest.raises(SourceError, match=r"cannot be opened .*; take another port"):
            ExitStack().enter_context(program_source(name, quiet, 1.0))
