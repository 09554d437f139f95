"""The table's serial port over telnet (RFC 2217), for pyserial's `rfc2217://host:port`: baud rate and break travel too.

pyserial's `PortManager` speaks telnet; here is the port that it believes to manage, and a guard: whatever a client
sends, the worst that happens is that its request is ignored.
"""

import struct
from collections.abc import Callable

import serial
from serial.rfc2217 import PortManager

from emulator.line.framing import rates_agree, read_at_rate
from emulator.ports.outbox import Outbox
from emulator.ports.tcp_port import TcpPort

_DEFAULT_BAUD = 9600
_LONGEST_REQUEST = 64
"""Bytes of a request between its beginning and its end; those of RFC 2217 have six at most."""
_BREAK = b"\0"
"""What a receiver reads of a line that is held low."""


class Rfc2217Port(TcpPort):
    """A listening socket as `TcpPort`, whose client sets the line as that of an adapter in its own computer.

    Args:
        host: name or address to listen on.
        port: TCP port, 0 for any that is free.
        baud: the table's rate in baud; 0 when bytes are not paced, and no rate of the client's is then wrong.
        warn: takes one sentence for the person who runs the emulator.

    Raises:
        OSError: the address cannot be listened on.
    """

    scheme = "rfc2217"

    def __init__(self, host: str, port: int, baud: int, warn: Callable[[str], None]) -> None:
        super().__init__(host, port, warn)
        self._baud = baud
        self._line = _Line(baud, self._purge)
        self._telnet: PortManager | None = None

    def _greet(self) -> None:
        """Begin anew, for a client that has just come: it finds the line at the table's own rate."""
        self._line = _Line(self._baud, self._purge)
        # Both have all that it uses of pyserial's ports.
        self._telnet = PortManager(self._line, _Answers(self._outbox))  # type: ignore[arg-type]  # see above
        self.flush()

    def _purge(self) -> None:
        self.flush()
        self._outbox.clear()

    def _decoded(self, data: bytes) -> bytes:
        """Return bytes as the table hears them, without those that are telnet's."""
        heard, at_one_rate = b"", b""
        for byte in data:
            before = self._line.baudrate
            passed = self._without_telnet(bytes((byte,)))
            if self._line.baudrate != before or self._line.breaks:
                heard += self._at_rate(at_one_rate, before, self._baud) + _BREAK * self._line.breaks
                at_one_rate, self._line.breaks = b"", 0
                self._notice_rate(before)
            at_one_rate += passed
        self.flush()
        return heard + self._at_rate(at_one_rate, self._line.baudrate, self._baud)

    def _without_telnet(self, byte: bytes) -> bytes:
        """Return the byte if it is the table's, and nothing if it is telnet's."""
        telnet = self._telnet
        if telnet is None:
            return byte
        try:
            passed = b"".join(telnet.filter(byte))
        except (ValueError, TypeError, KeyError, struct.error):  # a request that is cut, or has a value that is none
            telnet.suboption, telnet.mode = None, _NORMAL
            return b""
        if telnet.suboption is not None:
            telnet.suboption = telnet.suboption[:_LONGEST_REQUEST]
        return passed

    def _encoded(self, data: bytes) -> bytes:
        """Return bytes as the client reads them, escaped for telnet."""
        return self._at_rate(data, self._baud, self._line.baudrate).replace(
            serial.rfc2217.IAC, serial.rfc2217.IAC_DOUBLED
        )

    def _notice_rate(self, before: int) -> None:
        baud = self._line.baudrate
        if self._baud and baud != before and not rates_agree(baud, self._baud):
            self._warn(
                f"the client on {self.name} is set to {baud} baud and the table to {self._baud}: both read garbage "
                f"until the client is set to {self._baud} (or the table is started with --baud {baud})"
            )

    def _at_rate(self, data: bytes, sender_baud: int, receiver_baud: int) -> bytes:
        return read_at_rate(data, sender_baud, receiver_baud) if data and self._baud else data


_NORMAL: int = serial.rfc2217.M_NORMAL


class _Answers:
    """Where telnet's answers go: to the client, whole."""

    def __init__(self, outbox: Outbox) -> None:
        self._outbox = outbox

    def write(self, data: bytes) -> None:
        self._outbox.put_whole(data)


class _Line:
    """The port that telnet manages: it has a rate and a break, and else the three wires of the table.

    Its names are pyserial's. What the table does not have (parity, 7 bits, flow control) cannot be set, and the client
    is told so; lines that the table does not read may be set, and those that it does not drive are what a client that
    waits for them needs.
    """

    cts = dsr = cd = True
    ri = False
    dtr = rts = True
    xonxoff = rtscts = False

    def __init__(self, baud: int, purge: Callable[[], None]) -> None:
        self.baudrate = baud or _DEFAULT_BAUD
        self.breaks = 0  # that have begun and are not heard yet
        self._is_broken = False
        self._purge = purge

    @property
    def bytesize(self) -> int:
        """Always 8."""
        return serial.EIGHTBITS

    @bytesize.setter
    def bytesize(self, bits: int) -> None:
        if bits != serial.EIGHTBITS:
            raise ValueError("the table talks 8N1")

    @property
    def parity(self) -> str:
        """Always none."""
        return serial.PARITY_NONE

    @parity.setter
    def parity(self, parity: str) -> None:
        if parity != serial.PARITY_NONE:
            raise ValueError("the table talks 8N1")

    @property
    def stopbits(self) -> float:
        """Always 1."""
        return serial.STOPBITS_ONE

    @stopbits.setter
    def stopbits(self, bits: float) -> None:
        if bits != serial.STOPBITS_ONE:
            raise ValueError("the table talks 8N1")

    @property
    def break_condition(self) -> bool:
        """Whether the client holds the line low."""
        return self._is_broken

    @break_condition.setter
    def break_condition(self, is_on: bool) -> None:
        self.breaks += is_on and not self._is_broken
        self._is_broken = is_on

    def reset_input_buffer(self) -> None:
        """Forget the replies that the client has not taken yet."""
        self._purge()

    def reset_output_buffer(self) -> None:
        """Do nothing: what was sent is on the line already."""
