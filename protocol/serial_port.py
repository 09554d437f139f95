"""Open any pyserial port with one timeout for reading and writing, if the port has both."""

import warnings
from typing import Any

import serial
import serial.rfc2217

_RFC2217 = "rfc2217://"


class _Rfc2217Port(serial.rfc2217.Serial):
    """pyserial's port over RFC 2217, with a read timeout that is not negotiated.

    pyserial sends all settings again, and waits 50 ms or more, whenever the timeout is set.
    """

    def open(self) -> None:
        """Connect and negotiate the settings."""
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", DeprecationWarning)  # pyserial calls setDaemon and setName
            super().open()

    @property
    def timeout(self) -> float | None:
        """The maximum time that `read` waits, in seconds."""
        return self._timeout

    @timeout.setter
    def timeout(self, timeout_s: float | None) -> None:
        self._timeout = timeout_s


def open_serial_port(url: str, baud: int, timeout_s: float, **more: Any) -> Any:  # noqa: ANN401  # any pyserial port
    """Return the port for a device or URL.

    Args:
        url: a device or any pyserial URL.
        baud: rate in baud.
        timeout_s: timeout for reading and writing.
        more: other pyserial settings.

    Raises:
        OSError, ValueError: the port cannot be opened with these settings.
    """
    settings = {"baudrate": baud, "timeout": timeout_s, **more}
    if url.lower().startswith(_RFC2217):  # the port buffers written bytes, and has no write timeout
        return _Rfc2217Port(url, **settings)
    return serial.serial_for_url(url, write_timeout=timeout_s, **settings)
