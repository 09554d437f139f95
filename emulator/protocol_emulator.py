"""The pyserial port `emulator://`: a private table in the same process, in virtual time.

pyserial finds this module by its name once `emulator` is imported. Time passes only in calls. `read` advances it until
the bytes are available or the timeout is over, `flush` until all bytes are sent, and `clock.sleep_s` by its argument. A
look at `in_waiting`, or a read without waiting, that finds nothing takes one tick, so that a loop of them ends.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from typing import TYPE_CHECKING, Final
from urllib.parse import parse_qsl, urlsplit

import serial
from serial.serialutil import PortNotOpenError, SerialBase, SerialException, SerialTimeoutException

from emulator.config.table_config import ConfigError, TableConfig, load_config
from emulator.line.framing import rates_agree, read_at_rate
from emulator.table.fast_ticks import FastTicks
from emulator.table.table import Table

if TYPE_CHECKING:
    from _typeshed import ReadableBuffer

    from emulator.avr.compiled_table import AnyTable

OUTPUT_BYTES: Final = 4096
"""Maximum number of bytes in the buffer of the line, as in the driver of a real port, before a write waits."""

RUN: Final = FastTicks()
"""Advances the time of all tables of this process; compiled code is used when that is faster."""

_FORMS = {
    "config": "config=PATH",
    "firmware": "firmware=ELF",
    "seed": "seed=N",
    "baud": "baud=N",
    "decimals": "decimals=N",
    "strict": "strict=0|1",
    "trigger_hz": "trigger_hz=F",
}
_OPTIONS = ("config", "seed", "baud", "decimals", "strict", "trigger_hz")

SwitchOn = Callable[[TableConfig, int, Mapping[str, str]], "AnyTable"]
"""Makes a table of its configuration, its seed and the options of a URL."""


class VirtualClock:
    """The clock of a private table, for clients that read time only from the clock of their port."""

    def __init__(self, port: "Serial") -> None:
        self._line = port

    def now_s(self) -> float:
        """Return simulated seconds since the table was switched on."""
        return self._line.table.tick / self._line.table.config.control.tick_hz

    def sleep_s(self, duration_s: float) -> None:
        """Advance the simulated time."""
        self._line.advance(self._line.ticks(duration_s))


class Serial(SerialBase):
    """A pyserial port with its own table at the other end.

    It must not be used by several threads. The table stays the same when the port is closed and opened again.

    Attributes:
        table: the table, from the first opening; for tests.
        clock: the clock of the table.
    """

    table: "AnyTable"
    clock: VirtualClock

    @staticmethod
    def _switched_on(url: str) -> "AnyTable":
        """Return the table that a URL describes."""
        return table_of(url, "emulator", _OPTIONS, lambda config, seed, _: Table(config, seed, run=RUN))

    def open(self) -> None:
        """Switch the table on at the first opening, and connect to it.

        Raises:
            SerialException: the port is open, or its URL or its settings cannot be used.
        """
        if self.is_open:
            raise SerialException("Port is already open.")
        if self.port is None:
            raise SerialException("Port must be configured before it can be used.")
        if getattr(self, "_table_url", None) != self.port:
            self.table = self._switched_on(self.port)
            self.clock = VirtualClock(self)
            self._table_url = self.port
        self._require_line()
        self._received = bytearray()
        self._reconfigure_port()
        self.is_open = True

    def close(self) -> None:
        """Wait until the written bytes have reached the table, and disconnect. A running motion continues."""
        if self.is_open:
            with suppress(SerialException):  # The device may disappear with bytes still on the line.
                self.flush()
            self.table.disconnect()
            self.is_open = False

    @property
    def in_waiting(self) -> int:
        """Number of bytes that can be read without waiting; if there are none, one tick passes."""
        self._require_open()
        if not self._received:
            self.advance(1)
        return len(self._received)

    @property
    def out_waiting(self) -> int:
        """Number of bytes that have not reached the table."""
        self._require_open()
        return self.table.received_queue

    def read(self, size: int = 1) -> bytes:
        """Return `size` bytes, or fewer after the timeout.

        Raises:
            SerialException: there is no timeout, and nothing will be received.
        """
        self._require_open()
        if self.timeout == 0 and not self._received:
            self.advance(1)
        deadline = self._deadline(self.timeout)
        while (missing := size - len(self._received)) > 0 and self._advance_to_bytes(missing, deadline):
            pass
        if not self._received:
            self._require_line()
        return self._take(size)

    def read_until(self, expected: bytes = b"\n", size: int | None = None) -> bytes:
        """Return bytes up to and including `expected`, at most `size` of them; fewer after the timeout."""
        self._require_open()
        deadline = self._deadline(self.timeout)
        line = bytearray()
        while not line.endswith(expected) and (size is None or len(line) < size):
            if not self._received:
                wanted = self.table.outgoing.find(expected[-1:]) + 1 or len(self.table.outgoing) + 1
                wanted = wanted if size is None else min(wanted, size - len(line))
                if not self._advance_to_bytes(wanted, deadline):
                    break
            line += self._take(1)
        return bytes(line)

    def write(self, b: "ReadableBuffer", /) -> int:
        """Send bytes and return their number. It waits only while the buffer of the port is full.

        Raises:
            SerialTimeoutException: the write timeout passed first.
        """
        self._require_open()
        data = bytes(memoryview(b))
        unsent = self._at_rate(data, self.baudrate, self.table.config.serial.baud)
        deadline = self._deadline(self.write_timeout)
        while unsent:
            room = OUTPUT_BYTES - self.table.received_queue
            if room > 0:
                self.table.receive(unsent[:room])
                unsent = unsent[room:]
            elif not self._advance_to_byte(deadline):
                if self.write_timeout == 0:
                    return max(0, len(data) - len(unsent))
                raise SerialTimeoutException("Write timeout")
        self._collect()
        return len(data)

    def flush(self) -> None:
        """Advance the time until the table has received everything that was written."""
        self._require_open()
        while self.out_waiting:
            self._advance_to_byte(None)

    def reset_input_buffer(self) -> None:
        """Discard the received bytes that have not been read."""
        self._require_open()
        self._received.clear()

    def reset_output_buffer(self) -> None:
        """Do nothing: the written bytes are on the line already."""
        self._require_open()

    def advance(self, ticks: int) -> None:
        """Advance the simulated time. Replies received meanwhile wait for `read`."""
        self.table.advance(ticks)
        self._collect()

    def ticks(self, duration_s: float) -> int:
        """Return a duration in ticks, rounded up."""
        return math.ceil(duration_s * self.table.config.control.tick_hz)

    # The line has three wires. Requests for the others return what pyserial's network ports return.

    @property
    def cts(self) -> bool:
        """Clear to send: always."""
        return True

    @property
    def dsr(self) -> bool:
        """Data set ready: always."""
        return True

    @property
    def ri(self) -> bool:
        """Ring indicator: never."""
        return False

    @property
    def cd(self) -> bool:
        """Carrier detect: always."""
        return True

    def _update_rts_state(self) -> None: ...

    def _update_dtr_state(self) -> None: ...

    def _update_break_state(self) -> None: ...

    def _reconfigure_port(self) -> None:
        if self.bytesize != serial.EIGHTBITS or self.parity != serial.PARITY_NONE:
            raise SerialException(f"{self.port}: the table uses 8N1; open it with 8 data bits and no parity")
        if not self.baudrate:
            raise SerialException(f"{self.port}: a baud rate of 0 would hang up; use the baud rate of the table")

    def _require_open(self) -> None:
        if not self.is_open:
            raise PortNotOpenError
        self._require_line()

    def _require_line(self) -> None:
        if self.table.hung_up:
            raise SerialException(f"{self.port}: the device has disappeared (fault hang-up)")

    def _deadline(self, timeout_s: float | None) -> int | None:
        return None if timeout_s is None else self.table.tick + self.ticks(timeout_s)

    def _advance_to_byte(self, deadline: int | None) -> bool:
        """Advance the time to the end of the next byte on the line; return False at the deadline."""
        return self._advance(self.table.ticks_until_byte(), deadline)

    def _advance_to_bytes(self, wanted: int, deadline: int | None) -> bool:
        """Advance the time until `wanted` bytes may have been received; return False at the deadline."""
        if not self._is_understood():  # the effect of faults on a byte depends on how many arrive at once
            return self._advance_to_byte(deadline)
        return self._advance(self.table.ticks_until_sent(wanted), deadline)

    def _advance(self, ticks: int | None, deadline: int | None) -> bool:
        if deadline is None:
            if ticks is None:
                raise SerialException(f"{self.port}: without a timeout this read would not end: no reply is pending")
            self.advance(ticks)
            return True
        left = deadline - self.table.tick
        self.advance(left if ticks is None else min(left, ticks))
        return left > 0

    def _collect(self) -> None:
        self._received += self._at_rate(self.table.transmit(), self.table.config.serial.baud, self.baudrate)

    def _take(self, size: int) -> bytes:
        data = bytes(self._received[:size])
        del self._received[:size]
        return data

    def _is_understood(self) -> bool:
        baud = self.table.config.serial.baud
        return not baud or rates_agree(self.baudrate, baud)

    def _at_rate(self, data: bytes, sender_baud: int, receiver_baud: int) -> bytes:
        paced = bool(data and self.table.config.serial.baud)
        return read_at_rate(data, sender_baud, receiver_baud) if paced else data


def table_of(url: str, scheme: str, options: Sequence[str], switch_on: SwitchOn) -> "AnyTable":
    """Return the table that a URL describes.

    Args:
        url: such as `emulator://?seed=7`.
        scheme: the only one that is accepted.
        options: the names of those that are known.
        switch_on: makes a table of configuration, seed and the options given.

    Raises:
        SerialException: the URL has another form, or there is no such table.
    """
    form = f"{scheme}://[?{'&'.join(_FORMS[name] for name in options)}]"
    try:
        parts = urlsplit(url)
    except ValueError as error:
        raise SerialException(f"{url}: {error}; the form is {form}") from error
    given = dict(parse_qsl(parts.query, keep_blank_values=True))
    if parts.scheme != scheme or parts.netloc or parts.path not in {"", "/"} or not set(given) <= set(options):
        raise SerialException(f"{url} is not {form}")
    try:
        table = switch_on(_config_of(given), int(given.get("seed", "0")), given)
        table.trigger_hz = float(given.get("trigger_hz", "0"))
    except ConfigError as error:
        raise SerialException(f"{url}: {error}") from error
    except ValueError as error:
        raise SerialException(f"{url}: {error}; the form is {form}") from error
    return table


def _config_of(options: dict[str, str]) -> TableConfig:
    numbers = {name: int(options[name]) for name in ("baud", "decimals") if name in options}
    strict = options.get("strict")
    if strict not in {None, "0", "1"}:
        raise ValueError(f"strict is 0 or 1, not {strict}")
    return load_config(options.get("config")).with_serial(**numbers, strict=None if strict is None else strict == "1")
