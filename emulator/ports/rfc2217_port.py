"""The table's serial port over telnet (RFC 2217), for pyserial's `rfc2217://host:port`.

It also transmits baud rate and break.

pyserial's `PortManager` implements telnet. This module has the port that it manages, and a guard: an invalid request of
a client is ignored.
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
"""Maximum number of bytes of a request; those of RFC 2217 have at most six."""
_BREAK = b"\0"
"""What a receiver reads from a line that is held low."""


class Rfc2217Port(TcpPort):
    """A listening socket like `TcpPort`. The client can set the line like that of a local adapter.

    Args:
        host: name or address to listen on.
        port: TCP port; 0 picks a free port.
        baud: the table's rate in baud; 0 if bytes are not paced: then every rate of the client is accepted.
        warn: called with one sentence for the user of the emulator.

    Raises:
        OSError: the address is not available.
    """

    scheme = "rfc2217"

    def __init__(self, host: str, port: int, baud: int, warn: Callable[[str], None]) -> None:
        super().__init__(host, port, warn)
        self._baud = baud
        self._line = _Line(baud, self._purge)
        self._telnet: PortManager | None = None

    def _greet(self) -> None:
        """Reset the state for a new client: the line has the table's baud rate."""
        self._line = _Line(self._baud, self._purge)
        # Both have all methods of pyserial's ports that it uses.
        self._telnet = PortManager(self._line, _Answers(self._outbox))  # type: ignore[arg-type]  # see above
        self.flush()

    def _purge(self) -> None:
        self.flush()
        self._outbox.clear()

    def _decoded(self, data: bytes) -> bytes:
        """Return bytes as the table receives them, without the bytes of telnet."""
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
        """Return the byte if it is for the table, and nothing if it belongs to telnet."""
        telnet = self._telnet
        if telnet is None:
            return byte
        try:
            passed = b"".join(telnet.filter(byte))
        except (ValueError, TypeError, KeyError, struct.error):  # a truncated request, or one with an invalid value
            telnet.suboption, telnet.mode = None, _NORMAL
            return b""
        if telnet.suboption is not None:
            telnet.suboption = telnet.suboption[:_LONGEST_REQUEST]
        return passed

    def _encoded(self, data: bytes) -> bytes:
        """Return bytes as the client receives them, escaped for telnet."""
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
    """Where telnet's replies are sent: to the client, whole."""

    def __init__(self, outbox: Outbox) -> None:
        self._outbox = outbox

    def write(self, data: bytes) -> None:
        self._outbox.put_whole(data)


class _Line:
    """The port that telnet manages: it has a baud rate, a break, and the three wires of the table.

    Its names are pyserial's. Parity, 7 bits and flow control do not exist on the table: they cannot be set, and the
    client receives an error. Output lines may be set without effect. Input lines have the values that a waiting client
    needs.
    """

    cts = dsr = cd = True
    ri = False
    dtr = rts = True
    xonxoff = rtscts = False

    def __init__(self, baud: int, purge: Callable[[], None]) -> None:
        self.baudrate = baud or _DEFAULT_BAUD
        self.breaks = 0  # number of breaks that have started and are not yet processed
        self._is_broken = False
        self._purge = purge

    @property
    def bytesize(self) -> int:
        """Always 8."""
        return serial.EIGHTBITS

    @bytesize.setter
    def bytesize(self, bits: int) -> None:
        if bits != serial.EIGHTBITS:
            raise ValueError("the table uses 8N1")

    @property
    def parity(self) -> str:
        """Always none."""
        return serial.PARITY_NONE

    @parity.setter
    def parity(self, parity: str) -> None:
        if parity != serial.PARITY_NONE:
            raise ValueError("the table uses 8N1")

    @property
    def stopbits(self) -> float:
        """Always 1."""
        return serial.STOPBITS_ONE

    @stopbits.setter
    def stopbits(self, bits: float) -> None:
        if bits != serial.STOPBITS_ONE:
            raise ValueError("the table uses 8N1")

    @property
    def break_condition(self) -> bool:
        """Whether the client holds the line low."""
        return self._is_broken

    @break_condition.setter
    def break_condition(self, is_on: bool) -> None:
        self.breaks += is_on and not self._is_broken
        self._is_broken = is_on

    def reset_input_buffer(self) -> None:
        """Discard the replies that the client has not read yet."""
        self._purge()

    def reset_output_buffer(self) -> None:
        """Do nothing: the written bytes are on the line already."""
