"""The Unix socket of the control channel, accessible only to its owner: one line per request, one line per reply."""

import errno
import logging
import os
import socket
from contextlib import suppress
from pathlib import Path

from emulator.server.control_commands import Stand, answer, refusal

_log = logging.getLogger(__name__)

LONGEST_REQUEST = 4096
"""Maximum number of bytes of a request, including its line feed."""

MOST_CLIENTS = 64
"""Maximum number of clients: too many would use all descriptors that the system allows."""

_BACKLOG = 16
_OWNER_ONLY = 0o177
"""The permissions that a new socket must not have."""


class ControlSocket:
    """The listening end, with at most `MOST_CLIENTS` clients at once.

    Args:
        path: path of the socket. A socket that an ended emulator left is replaced.

    Raises:
        OSError: another file is at the path, another emulator listens there, or the path is not writable.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        _clear_stale(path)
        self._listener = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
        # Unlike a later chmod, the mask leaves no moment in which others can connect.
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
        """Descriptors that become readable when a client connects, disconnects or sends a request."""
        return (self._listener.fileno(), *(client.fileno() for client in self._clients))

    def serve(self, stand: Stand) -> None:
        """Accept new clients and reply to every complete request."""
        # No client is waiting, or it has disconnected, or the system has no free descriptor: then it waits.
        with suppress(OSError):
            for _ in range(_BACKLOG):  # no more at a time: many requests must not delay the clients of the table
                self._welcome(self._listener.accept()[0])
        for client in list(self._clients):
            if not self._serve_client(client, stand):
                del self._clients[client]
                client.close()

    def close(self) -> None:
        """Disconnect all clients and remove the socket, unless another one has replaced it."""
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
        """Return whether the client stays connected: not after a disconnect, or if it does not read its replies."""
        try:
            data = client.recv(LONGEST_REQUEST)
        except BlockingIOError:
            return True
        except OSError:
            return False
        *requests, rest = (self._clients[client] + data).split(b"\n")
        self._clients[client] = rest
        for request in requests:
            _log.debug("control request %r", request)
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
    """Remove a socket that nobody listens on. Do not change anything else."""
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
            pass  # The listener's queue is full: the emulator is alive, although it accepts no client.
    raise OSError(errno.EADDRINUSE, "another emulator listens there")
