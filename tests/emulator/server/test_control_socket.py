"""The socket of the control channel, and clients that send in pieces, in large numbers or not at all."""

import json
import os
import random
import resource
import socket
import stat
import sys
from contextlib import ExitStack, suppress
from pathlib import Path

import pytest

from emulator.control_client import request
from emulator.server.control_socket import LONGEST_REQUEST, MOST_CLIENTS, ControlSocket
from tests.emulator.quiet_stand import QuietStand

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="Unix sockets")


def test_the_socket_is_its_owners_only(folder: Path) -> None:
    control = ControlSocket(folder / "control")
    assert stat.S_IMODE(control.path.stat().st_mode) == 0o600
    control.close()
    assert not control.path.exists()


def test_the_mask_of_new_files_is_left_as_it_was(folder: Path) -> None:
    before = os.umask(0o022)
    ControlSocket(folder / "control").close()
    assert os.umask(before) == 0o022


def test_a_socket_that_a_dead_emulator_left_is_replaced(folder: Path) -> None:
    path = folder / "control"
    with socket.socket(socket.AF_UNIX) as dead:
        dead.bind(str(path))
    ControlSocket(path).close()


def test_a_socket_that_is_served_is_left_alone(served: Path) -> None:
    with pytest.raises(OSError, match="another emulator"):
        ControlSocket(served)
    assert request(served, "trigger") == {}


def test_an_ordinary_file_is_never_overwritten(folder: Path) -> None:
    path = folder / "thesis.tex"
    path.write_text("three years of work")
    with pytest.raises(OSError, match="in use"):
        ControlSocket(path)
    assert path.read_text() == "three years of work"


def test_requests_may_come_in_pieces_and_several_at_once(served: Path) -> None:
    with socket.socket(socket.AF_UNIX) as client, client.makefile("rb") as replies:
        client.settimeout(5.0)
        client.connect(str(served))
        client.sendall(b'{"command": "tri')
        client.sendall(b'gger"}\n{"command": "reset"}\nnonsense\n')
        assert [json.loads(replies.readline())["ok"] for _ in range(3)] == [True, True, False]


def test_a_request_without_end_is_cut_off(served: Path) -> None:
    with socket.socket(socket.AF_UNIX) as client, client.makefile("rb") as replies:
        client.settimeout(5.0)
        client.connect(str(served))
        client.sendall(b"x" * LONGEST_REQUEST)
        assert "at most" in json.loads(replies.readline())["error"]
        assert replies.readline() == b""


def test_a_client_for_whom_the_system_has_no_descriptor_waits_and_the_others_are_served(
    folder: Path, stand: QuietStand
) -> None:
    control = ControlSocket(folder / "control")
    before, most = resource.getrlimit(resource.RLIMIT_NOFILE)
    with ExitStack() as stack:
        stack.callback(control.close)
        first, second = (stack.enter_context(socket.socket(socket.AF_UNIX)) for _ in range(2))
        first.connect(str(control.path))
        control.serve(stand)
        second.connect(str(control.path))
        second.sendall(b'{"command": "reset"}\n')
        first.sendall(b'{"command": "trigger"}\n')
        next_free = os.dup(first.fileno())
        os.close(next_free)
        resource.setrlimit(resource.RLIMIT_NOFILE, (next_free, most))
        try:
            control.serve(stand)
        finally:
            resource.setrlimit(resource.RLIMIT_NOFILE, (before, most))
        assert stand.done == ["trigger"]
        control.serve(stand)
    assert stand.done == ["trigger", "reset 0"]


def test_clients_that_go_without_a_word_harm_nobody(served: Path) -> None:
    for _ in range(20):
        with socket.socket(socket.AF_UNIX) as client:
            client.connect(str(served))
            client.sendall(b'{"command": "state"}\n{"comm')
    assert request(served, "trigger") == {}


def test_a_crowd_of_clients_is_turned_away_and_those_who_were_there_are_served(folder: Path, stand: QuietStand) -> None:
    control = ControlSocket(folder / "control")
    with ExitStack() as stack:
        stack.callback(control.close)
        clients = [stack.enter_context(socket.socket(socket.AF_UNIX)) for _ in range(MOST_CLIENTS + 1)]
        for client in clients:
            client.settimeout(5.0)
            client.connect(str(control.path))
            control.serve(stand)
        assert b"too many" in clients[-1].recv(4096)
        assert clients[-1].recv(4096) == b""
        clients[0].sendall(b'{"command": "trigger"}\n')
        control.serve(stand)
        assert json.loads(clients[0].recv(4096)) == {"ok": True}
        clients[0].close()
        control.serve(stand)
        latecomer = stack.enter_context(socket.socket(socket.AF_UNIX))
        latecomer.connect(str(control.path))
        latecomer.sendall(b'{"command": "reset"}\n')
        control.serve(stand)
    assert stand.done == ["trigger", "reset 0"]


def test_a_listener_that_takes_nobody_in_is_neither_waited_for_nor_removed(folder: Path) -> None:
    path = folder / "control"
    with ExitStack() as stack:
        deaf = stack.enter_context(socket.socket(socket.AF_UNIX))
        deaf.bind(str(path))
        deaf.listen(0)
        for _ in range(3):  # until its queue is full
            waiting = stack.enter_context(socket.socket(socket.AF_UNIX))
            waiting.setblocking(False)
            with suppress(BlockingIOError):
                waiting.connect(str(path))
        with pytest.raises(OSError, match="another emulator"):
            ControlSocket(path)
        assert path.is_socket()


def test_thousands_of_connections_and_any_bytes_keep_nobody_from_the_table(folder: Path, stand: QuietStand) -> None:
    chance = random.Random(1)  # noqa: S311  # a test's draw
    control = ControlSocket(folder / "control")
    with ExitStack() as stack:
        stack.callback(control.close)
        for index in range(2000):
            with socket.socket(socket.AF_UNIX) as client:
                client.connect(str(control.path))
                client.sendall(chance.randbytes(chance.randint(0, 200)) + b"\n" * chance.randint(0, 3))
                if index % 7 == 0:
                    control.serve(stand)
        while len(control.input_descriptors) > 1:
            control.serve(stand)
        friend = stack.enter_context(socket.socket(socket.AF_UNIX))
        friend.connect(str(control.path))
        friend.sendall(b'{"command": "trigger"}\n')
        control.serve(stand)
        assert json.loads(friend.recv(4096)) == {"ok": True}
    assert stand.done == ["trigger"]
