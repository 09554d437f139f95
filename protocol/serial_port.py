"""Open any port of pyserial's with one time-out for reading and writing, where the port has both."""

from typing import Any

import serial


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
    try:
        return serial.serial_for_url(url, write_timeout=timeout_s, **settings)
    except NotImplementedError:  # by `rfc2217://`, which buffers what is written and never waits
        return serial.serial_for_url(url, **settings)
