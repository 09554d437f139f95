"""A pseudo-terminal that behaves like the serial port of the table (POSIX only).

The device is in raw mode and at the table's baud rate before its name is published. The server keeps it open, nothing
here blocks, and the connection of clients is observed.
"""

import fcntl
import os
import termios
import time
import tty
from collections.abc import Callable
from functools import partial
from pathlib import Path

from emulator.line.framing import rates_agree, read_at_rate
from emulator.ports.device_link import DeviceLink
from emulator.ports.inotify import CLOSED, OPENED, WRITTEN, DeviceWatch
from emulator.ports.outbox import Outbox
from emulator.ports.port import Arrival, changes_nothing
from emulator.ports.readiness import wait_for
from emulator.ports.terminal_baud import get_baud, set_baud
from emulator.ports.visit import Visit

READ_BYTES = 256
"""Maximum number of bytes read at once from a connected client."""

_PTY_BYTES = 1 << 17
"""More than the buffer of a pty."""

_IN_FLIGHT_MS = 5
"""Within this time after the bytes of a write, the kernel has reported it, on a busy machine too."""

_DEFAULT_BAUD = 9600
_LOCAL_MODES = 3  # index in the list of termios.tcgetattr
_ECHO = termios.ECHO | termios.ECHONL


class PtyPort:
    """The server's end of a pty. A client opens the other end as a serial port.

    Args:
        baud: the table's rate in baud; 0 if bytes are not paced: then every rate of the client is accepted.
        warn: called with one sentence for the user of the emulator.

    Attributes:
        link: the symbolic link to the device, if any.

    Raises:
        OSError: the system has no free pty.
    """

    def __init__(self, baud: int, warn: Callable[[str], None]) -> None:
        self._baud = baud
        self._warn = warn
        self.link: DeviceLink | None = None
        self._outbox = Outbox()
        self._said_doubtful = False
        self._open()

    def _open(self) -> None:
        self._is_away = False
        self._server, self._device = os.openpty()
        tty.setraw(self._device)
        set_baud(self._device, self._baud or _DEFAULT_BAUD)
        os.set_blocking(self._server, False)
        self._settings = termios.tcgetattr(self._device)
        self.name = os.ttyname(self._device)
        self._watch = DeviceWatch.start(Path(self.name))
        if self._watch is None:
            self._warn(
                f"this system does not report who opens {self.name}: "
                "a client that disconnects within a line is not noticed"
            )
        self._clients = 0
        self._unread = False  # whether bytes may have been written since the device was read empty
        self._client_baud = self._baud

    @property
    def client_count(self) -> int:
        """Programs that have the device open, if the system reports them."""
        return self._clients

    @property
    def input_descriptors(self) -> tuple[int, ...]:
        """Descriptors that become readable when a client connects, disconnects or sends."""
        if self._is_away:
            return ()
        return (self._server,) if self._watch is None else (self._server, self._watch.descriptor)

    @property
    def output_descriptors(self) -> tuple[int, ...]:
        """Descriptors that become writable when the client has read, while replies wait for it."""
        return (self._server,) if self._outbox else ()

    def receive(self) -> Arrival:
        """Return the actions of clients since the last call."""
        visit = self._follow_clients(Visit(writers=int(self._unread), counted=self._unread))
        data = self._read(whole=visit.left)
        visit = self._follow_clients(visit)  # Their actions of this moment may be in these bytes.
        if visit.left and self._unread:
            data += self._read(whole=True)
            visit = self._follow_clients(visit)
        if not visit.left:
            return Arrival(data=data)
        if data and visit.another_came and not visit.another_wrote:
            visit = self._wait_for_a_write(visit)
        self._let_go()
        is_doubtful = bool(data) and visit.is_doubtful
        if is_doubtful and not changes_nothing(data) and not self._said_doubtful:
            self._warn(
                f"two programs used {self.name} in immediate succession, and their bytes cannot be separated: "
                "commands in these bytes are not executed"
            )
            self._said_doubtful = True
        if visit.another_wrote:
            return Arrival(left_before=True, data=data, is_doubtful=is_doubtful)
        return Arrival(data=data, left_after=True, is_doubtful=is_doubtful)

    def send(self, data: bytes) -> None:
        """Send replies to the client. They are lost if nobody has the port open, or nobody reads it."""
        if self._is_away or (self._watch is not None and self._clients == 0):
            return
        self._end_echo()
        was_dropping = bool(self._outbox.dropped_bytes)
        self._outbox.put(self._as_heard(data, self._baud, self._client_baud))
        self.flush()
        if self._outbox.dropped_bytes and not was_dropping:
            self._warn(f"the client on {self.name} does not read its replies: they are dropped")

    def flush(self) -> None:
        """Send more of the replies that the client has not read yet."""
        self._outbox.flush(partial(os.write, self._server))

    def hang_up(self) -> None:
        """Disappear, as an adapter that is unplugged: a client reads end of file, and the device no longer exists."""
        self.close()
        self._is_away = True
        self._outbox.clear()

    def come_back(self) -> None:
        """Reappear after `hang_up` with a new device. The link points to it."""
        self._open()
        self._warn(f"the port is available again as {self.name}")
        if self.link is not None:
            try:
                self.link.lead_to(self.name)
            except OSError as error:
                self._warn(f"{self.link.path} does not point to it: {error.strerror}")

    def close(self) -> None:
        """Close both ends; a connected client reads end of file."""
        if self._is_away:
            return
        if self._watch is not None:
            self._watch.close()
        os.close(self._device)
        os.close(self._server)

    def _read(self, whole: bool = False) -> bytes:
        """Return bytes as the table receives them: all available bytes, or at most `READ_BYTES`."""
        self._end_echo()
        self._notice_rate()
        data = bytearray()
        limit = _PTY_BYTES if whole else READ_BYTES
        self._unread = True
        try:
            while len(data) < limit:
                data += os.read(self._server, min(READ_BYTES, limit - len(data)))
        except BlockingIOError:
            self._unread = False
        return self._as_heard(bytes(data), self._client_baud, self._baud)

    def _follow_clients(self, visit: Visit) -> Visit:
        """Return the present visit, updated with the actions of clients since then."""
        writers, counted, left, another_came = visit
        for event in self._watch.events() if self._watch is not None else ():
            if event == OPENED:
                self._clients += 1
                another_came = left
                if self._clients == 2:
                    self._warn(f"two programs have {self.name} open: each receives some of the other's replies")
            elif event == CLOSED:
                self._clients = max(0, self._clients - 1)
                if self._clients == 0:
                    counted, left, another_came = False, True, False
            elif event == WRITTEN:
                self._unread = True
                writers += not counted
                counted = True
        return Visit(writers, counted, left, another_came)

    def _wait_for_a_write(self, visit: Visit) -> Visit:
        """Return the visit with a write of the new client, if its bytes have already been read.

        The kernel reports a write only after its bytes are available.
        """
        for _ in range(_IN_FLIGHT_MS):
            time.sleep(0.001)
            later = self._follow_clients(visit)
            if later != visit:
                readable, _ = wait_for([self._server], [], 0.0)
                return visit if readable else later
        return visit

    def _end_echo(self) -> None:
        """Switch off the echo that a client has switched on: the table would reply to its own replies without end."""
        settings = termios.tcgetattr(self._server)
        if settings[_LOCAL_MODES] & _ECHO:
            settings = termios.tcgetattr(self._device)
            settings[_LOCAL_MODES] &= ~_ECHO
            termios.tcsetattr(self._device, termios.TCSANOW, settings)
            self._warn(f"a program switched the echo of {self.name} on (stty sane does so): it is switched off again")

    def _let_go(self) -> None:
        """Discard the state of a client that has disconnected, and reset the device for the next one."""
        if self._outbox.dropped_bytes:
            self._warn(f"{self._outbox.dropped_bytes} bytes of replies were dropped, because nobody read them")
        self._outbox.clear()
        self._client_baud = self._baud
        if self._clients:
            return
        termios.tcflush(self._device, termios.TCIFLUSH)
        # A terminal program may have locked the device, and the lock would last as long as the server.
        fcntl.ioctl(self._device, termios.TIOCNXCL)
        if termios.tcgetattr(self._device) != self._settings:
            termios.tcsetattr(self._device, termios.TCSANOW, self._settings)
            set_baud(self._device, self._baud or _DEFAULT_BAUD)

    def _notice_rate(self) -> None:
        """Read the client's baud rate, and warn if it has changed to one that the table does not understand."""
        client_baud = get_baud(self._server)
        if client_baud in {self._client_baud, 0} or not self._baud:
            return
        self._client_baud = client_baud
        if not rates_agree(client_baud, self._baud):
            self._warn(
                f"the client on {self.name} is set to {client_baud} baud and the table to {self._baud}: both read "
                f"garbage until the client is set to {self._baud} (or the table is started with --baud {client_baud})"
            )

    def _as_heard(self, data: bytes, sender_baud: int, receiver_baud: int) -> bytes:
        if not (data and self._baud and sender_baud and receiver_baud):
            return data
        return read_at_rate(data, sender_baud, receiver_baud)
