"""The control channel's Unix socket, open to its owner only: a line for each request, a line for each answer."""

import errno
import os
import socket
from contextlib import suppress
from pathlib import Path

from emulator.server.control_commands import Stand, answer, refusal

LONGEST_REQUEST = 4096
"""Bytes in a request, its line feed included."""

MOST_CLIENTS = 64
"""Clients at once; a crowd would take all descriptors that the system allows."""

_BACKLOG = 16
_OWNER_ONLY = 0o177
"""The mask of permissions that a new socket must not have."""


class ControlSocket:
    """The listening end; up to `MOST_CLIENTS` may be there at once.

    Args:
        path: where the socket is put. One that an emulator which has died left behind is replaced.

    Raises:
        OSError: something else is at the path, another emulator listens there, or it cannot be written.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        _clear_stale(path)
        self._listener = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
        # The mask, unlike a later chmod, leaves no moment in which others can connect.
        mask = os.umask(_OWNER_ONLY)
        try:
            self._listener.bind(str(path))
        except OSError:
            self._listener.close()
            raise
        finally:
            os.umask(mask)
        self._inode = path.stat().st_ino
        self._listener.listen(_BACKLOG)
        self._listener.setblocking(False)
        self._clients: dict[socket.socket, bytes] = {}

    @property
    def input_descriptors(self) -> tuple[int, ...]:
        """What becomes readable when a client comes, goes or asks."""
        return (self._listener.fileno(), *(client.fileno() for client in self._clients))

    def serve(self, stand: Stand) -> None:
        """Take in new clients and answer every request that has come in whole."""
        # Nobody is left, or the next one is gone again, or the system is short of descriptors: then it waits.
        with suppress(OSError):
            for _ in range(_BACKLOG):  # and no more at a time: a crowd must not keep the table from its clients
                self._welcome(self._listener.accept()[0])
        for client in list(self._clients):
            if not self._serve_client(client, stand):
                del self._clients[client]
                client.close()

    def close(self) -> None:
        """Hang up and remove the socket, unless another has taken its place."""
        for client in self._clients:
            client.close()
        self._listener.close()
        with suppress(OSError):
            if self.path.stat().st_ino == self._inode:
                self.path.unlink()

    def _welcome(self, client: socket.socket) -> None:
        client.setblocking(False)
        if len(self._clients) < MOST_CLIENTS:
            self._clients[client] = b""
            return
        with client, suppress(OSError):
            client.sendall(refusal(f"too many clients: {MOST_CLIENTS} are connected already"))

    def _serve_client(self, client: socket.socket, stand: Stand) -> bool:
        """Return whether the client stays: not when it hung up, or lets its answers pile up."""
        try:
            data = client.recv(LONGEST_REQUEST)
        except BlockingIOError:
            return True
        except OSError:
            return False
        *requests, rest = (self._clients[client] + data).split(b"\n")
        self._clients[client] = rest
        answers = b"".join(answer(request, stand) for request in requests)
        too_long = len(rest) >= LONGEST_REQUEST
        if too_long:
            answers += refusal(f"a request has at most {LONGEST_REQUEST} bytes and ends in a line feed")
        try:
            client.sendall(answers)
        except OSError:
            return False
        return bool(data) and not too_long


def _clear_stale(path: Path) -> None:
    """Remove a socket that nobody listens on; leave anything else alone."""
    if not path.is_socket():
        return
    with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as probe:
        probe.setblocking(False)
        try:
            probe.connect(str(path))
        except ConnectionRefusedError:
            path.unlink()
            return
        except BlockingIOError:
            pass  # The listener's queue is full: it lives, although it takes nobody in.
    raise OSError(errno.EADDRINUSE, "another emulator listens there")
