"""A pseudo-terminal that behaves as the serial port of the table (POSIX only).

The device is raw and at the table's own rate before its name is known, the server holds it open for ever, nothing
here blocks, and the clients that come and go are watched.
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
"""What one look takes of a client that stays."""

_PTY_BYTES = 1 << 17
"""More than a pty holds."""

_IN_FLIGHT_MS = 5
"""Within this time after the bytes of a write, the kernel has told of it, on a busy machine too."""

_DEFAULT_BAUD = 9600
_LOCAL_MODES = 3  # its place in the list of termios.tcgetattr
_ECHO = termios.ECHO | termios.ECHONL


class PtyPort:
    """The server's end of a pty whose other end a client opens as a serial port.

    Args:
        baud: the table's rate in baud; 0 when bytes are not paced, and no rate of the client's is then wrong.
        warn: takes one sentence for the person who runs the emulator.

    Attributes:
        link: what leads to the device by another name.

    Raises:
        OSError: the system has no pty to give.
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
                f"this system does not tell who opens {self.name}: a client that leaves in mid-line goes unnoticed"
            )
        self._clients = 0
        self._unread = False  # whether something may have been written since the device was read empty
        self._client_baud = self._baud

    @property
    def client_count(self) -> int:
        """Programs that have the device open, where the system tells."""
        return self._clients

    @property
    def input_descriptors(self) -> tuple[int, ...]:
        """What becomes readable when a client comes, goes or sends."""
        if self._is_away:
            return ()
        return (self._server,) if self._watch is None else (self._server, self._watch.descriptor)

    @property
    def output_descriptors(self) -> tuple[int, ...]:
        """What becomes writable when the client has read something, while replies are held back for it."""
        return (self._server,) if self._outbox else ()

    def receive(self) -> Arrival:
        """Return what clients have done since the last call."""
        visit = self._follow_clients(Visit(writers=int(self._unread), counted=self._unread))
        data = self._read(whole=visit.left)
        visit = self._follow_clients(visit)  # What they did meanwhile may be in these bytes.
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
                f"two programs used {self.name} one right after the other, and nobody can tell which bytes are whose: "
                "what came in one piece of both is not carried out"
            )
            self._said_doubtful = True
        if visit.another_wrote:
            return Arrival(left_before=True, data=data, is_doubtful=is_doubtful)
        return Arrival(data=data, left_after=True, is_doubtful=is_doubtful)

    def send(self, data: bytes) -> None:
        """Give replies to the client; they are lost when nobody has the port open, or nobody reads it."""
        if self._is_away or (self._watch is not None and self._clients == 0):
            return
        self._end_echo()
        was_dropping = bool(self._outbox.dropped_bytes)
        self._outbox.put(self._as_heard(data, self._baud, self._client_baud))
        self.flush()
        if self._outbox.dropped_bytes and not was_dropping:
            self._warn(f"the client on {self.name} does not read its replies: they are dropped")

    def flush(self) -> None:
        """Give the client more of the replies that it has not taken yet."""
        self._outbox.flush(partial(os.write, self._server))

    def hang_up(self) -> None:
        """Go away, as an adapter that is pulled out: a client reads end of file, and the device is no more."""
        self.close()
        self._is_away = True
        self._outbox.clear()

    def come_back(self) -> None:
        """Be there again after `hang_up`: a new device, to which the link leads."""
        self._open()
        self._warn(f"the port has come back as {self.name}")
        if self.link is not None:
            try:
                self.link.lead_to(self.name)
            except OSError as error:
                self._warn(f"{self.link.path} does not lead to it: {error.strerror}")

    def close(self) -> None:
        """Close both ends; a client that is still there reads end of file."""
        if self._is_away:
            return
        if self._watch is not None:
            self._watch.close()
        os.close(self._device)
        os.close(self._server)

    def _read(self, whole: bool = False) -> bytes:
        """Return bytes as the table hears them: all that are there, or no more than `READ_BYTES`."""
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
        """Return what was known of a visit with what clients have done since."""
        writers, counted, left, another_came = visit
        for event in self._watch.events() if self._watch is not None else ():
            if event == OPENED:
                self._clients += 1
                another_came = left
                if self._clients == 2:
                    self._warn(f"two programs have {self.name} open: each takes some of the other's replies")
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
        """Return the visit with a write of the one that came, if its bytes are read already.

        The kernel tells of a write only after its bytes are there.
        """
        for _ in range(_IN_FLIGHT_MS):
            time.sleep(0.001)
            later = self._follow_clients(visit)
            if later != visit:
                readable, _ = wait_for([self._server], [], 0.0)
                return visit if readable else later
        return visit

    def _end_echo(self) -> None:
        """Switch off the echo that a client has switched on: the table would answer its own replies for ever."""
        settings = termios.tcgetattr(self._server)
        if settings[_LOCAL_MODES] & _ECHO:
            settings = termios.tcgetattr(self._device)
            settings[_LOCAL_MODES] &= ~_ECHO
            termios.tcsetattr(self._device, termios.TCSANOW, settings)
            self._warn(f"a program switched the echo of {self.name} on (stty sane does so): it is switched off again")

    def _let_go(self) -> None:
        """Forget a client that has left, and leave the device to the next one as the first one found it."""
        if self._outbox.dropped_bytes:
            self._warn(f"{self._outbox.dropped_bytes} bytes of replies were dropped, since nobody read them")
        self._outbox.clear()
        self._client_baud = self._baud
        if self._clients:
            return
        termios.tcflush(self._device, termios.TCIFLUSH)
        # A terminal program may have locked the device, which otherwise ends only with the server.
        fcntl.ioctl(self._device, termios.TIOCNXCL)
        if termios.tcgetattr(self._device) != self._settings:
            termios.tcsetattr(self._device, termios.TCSANOW, self._settings)
            set_baud(self._device, self._baud or _DEFAULT_BAUD)

    def _notice_rate(self) -> None:
        """Look up the client's rate, and say so when it is a new one that the table does not understand."""
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
