"""Open any port of pyserial's with one time-out for reading and writing, where the port has both."""

import warnings
from typing import Any

import serial
import serial.rfc2217

_RFC2217 = "rfc2217://"


class _Rfc2217Port(serial.rfc2217.Serial):
    """pyserial's port over RFC 2217, whose read time-out is not negotiated.

    pyserial sends all settings anew, and waits 50 ms or more, whenever the time-out is set.
    """

    def open(self) -> None:
        """Connect, and negotiate the settings."""
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", DeprecationWarning)  # pyserial calls setDaemon and setName
            super().open()

    @property
    def timeout(self) -> float | None:
        """How long `read` waits, in seconds."""
        return self._timeout

    @timeout.setter
    def timeout(self, timeout_s: float | None) -> None:
        self._timeout = timeout_s


def open_serial_port(url: str, baud: int, timeout_s: float, **more: Any) -> Any:  # noqa: ANN401  # some port of pyserial's
    """Return the port of a device or URL.

    Args:
        url: the device, or any URL of pyserial's.
        baud: rate in baud.
        timeout_s: for reading, and for writing too.
        more: other settings of pyserial's.

    Raises:
        OSError, ValueError: it cannot be opened so.
    """
    settings = {"baudrate": baud, "timeout": timeout_s, **more}
    if url.lower().startswith(_RFC2217):  # it buffers what is written, and has no time-out for that
        return _Rfc2217Port(url, **settings)
    return serial.serial_for_url(url, write_timeout=timeout_s, **settings)
