"""The table's serial port over TCP, for pyserial's `socket://host:port`."""

import ipaddress
import socket
from collections.abc import Callable
from contextlib import suppress

from emulator.ports.outbox import Outbox
from emulator.ports.port import Arrival
from protocol.files.data_file import shown

LOOPBACK = "127.0.0.1"
READ_BYTES = 256
"""Maximum number of bytes read at once."""


def parse_address(text: str) -> tuple[str, int]:
    """Return host and port of `[HOST:]PORT`; the default host is the loopback address.

    An IPv6 address stands in brackets: `[::1]:7000`.

    Raises:
        ValueError: the text is not such an address.
    """
    host, _, port = text.rpartition(":")
    bare = host[1:-1] if host.startswith("[") and host.endswith("]") else host
    is_port = port.isascii() and port.isdigit() and len(port) <= 5 and int(port) <= 65535
    if not is_port or (":" in bare and bare == host):
        raise ValueError(f"{shown(text)} is not [HOST:]PORT with a port from 0 (any free one) to 65535")
    return bare or LOOPBACK, int(port)


class TcpPort:
    """A listening socket that serves one client at a time. Further clients are disconnected at once.

    Args:
        host: name or address to listen on.
        port: TCP port; 0 picks a free port.
        warn: called with one sentence for the user of the emulator.

    Raises:
        OSError: the address is not available.
    """

    scheme = "socket"

    def __init__(self, host: str, port: int, warn: Callable[[str], None]) -> None:
        self._warn = warn
        family = socket.AF_INET6 if ":" in host else socket.AF_INET
        self._listener = socket.create_server((host, port), family=family)
        self._listener.setblocking(False)
        self._client: socket.socket | None = None
        self._outbox = Outbox()
        self._is_away = False
        bound_port = self._listener.getsockname()[1]
        shown = f"[{host}]" if ":" in host else host
        self.name = f"{self.scheme}://{shown}:{bound_port}"
        if not _is_own_computer(self._listener.getsockname()[0]):
            warn(f"{self.name} is open to other computers: anyone with network access can move the table")

    @property
    def client_count(self) -> int:
        """1 while a client is connected, else 0."""
        return int(self._client is not None)

    @property
    def input_descriptors(self) -> tuple[int, ...]:
        """Descriptors that become readable when a client connects, disconnects or sends."""
        listener = self._listener.fileno()
        return (listener,) if self._client is None else (listener, self._client.fileno())

    @property
    def output_descriptors(self) -> tuple[int, ...]:
        """Descriptors that become writable when the client has read, while replies wait for it."""
        return (self._client.fileno(),) if self._client is not None and self._outbox else ()

    def receive(self) -> Arrival:
        """Return the actions of the client since the last call."""
        arrival = self._read()
        self._accept()
        return arrival

    def send(self, data: bytes) -> None:
        """Send replies to the client. They are lost if there is none, or if it does not read."""
        if self._client is None:
            return
        was_dropping = bool(self._outbox.dropped_bytes)
        self._outbox.put(self._encoded(data))
        self.flush()
        if self._outbox.dropped_bytes and not was_dropping:
            self._warn(f"the client on {self.name} does not read its replies: they are dropped")

    def flush(self) -> None:
        """Send more of the replies that the client has not read yet."""
        if self._client is not None:
            try:
                self._outbox.flush(self._client.send)
            except OSError:
                self._outbox.clear()  # The connection is broken: the next read reports it.

    def hang_up(self) -> None:
        """Disappear, as an adapter that is unplugged: clients are disconnected at once."""
        self._hang_up()
        self._is_away = True

    def come_back(self) -> None:
        """Reappear after `hang_up`."""
        self._is_away = False

    def close(self) -> None:
        """Disconnect and stop listening."""
        self._hang_up()
        self._listener.close()

    def _read(self) -> Arrival:
        if self._client is None:
            return Arrival()
        try:
            data = self._client.recv(READ_BYTES)
        except BlockingIOError:
            return Arrival()
        except OSError:
            data = b""
        if not data:
            self._hang_up()
            return Arrival(left_after=True)
        return Arrival(data=self._decoded(data))

    def _accept(self) -> None:
        # A client may have disconnected before it is accepted.
        with suppress(OSError):
            client, (host, port, *_) = self._listener.accept()
            if self._is_away:
                client.close()
            elif self._client is None:
                _prepare(client)
                self._client = client
                self._greet()
            else:
                client.close()
                self._warn(
                    f"a second client ({host}, port {port}) was refused: {self.name} serves one client at a time"
                )

    def _greet(self) -> None:
        """Send what a new client needs: here nothing."""

    def _decoded(self, data: bytes) -> bytes:
        """Return bytes as the table receives them."""
        return data

    def _encoded(self, data: bytes) -> bytes:
        """Return bytes as the client receives them."""
        return data

    def _hang_up(self) -> None:
        if self._outbox.dropped_bytes:
            self._warn(f"{self._outbox.dropped_bytes} bytes of replies were dropped, because nobody read them")
        self._outbox.clear()
        if self._client is not None:
            self._client.close()
            self._client = None


def _is_own_computer(address: str) -> bool:
    return ipaddress.ip_address(address.partition("%")[0]).is_loopback


def _prepare(client: socket.socket) -> None:
    client.setblocking(False)
    client.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
    # A client whose machine has failed must not block the table without end.
    client.setsockopt(socket.SOL_SOCKET, socket.SO_KEEPALIVE, 1)
    for option, value in (("TCP_KEEPIDLE", 10), ("TCP_KEEPINTVL", 5), ("TCP_KEEPCNT", 3)):
        if hasattr(socket, option):  # not on every system
            client.setsockopt(socket.IPPROTO_TCP, getattr(socket, option), value)
