"""Open the port at which a table is."""

import serial

from protocol import Port, PortError

# The stand-in's port `emulator://` is found by pyserial wherever the stand-in is installed; nothing of it is used here.
_STAND_IN = "emulator"


def open_port(url: str, baud: int, timeout_s: float) -> Port:
    """Return an open port: a device, or any URL of pyserial's.

    Raises:
        PortError: it cannot be opened.
    """
    if _STAND_IN not in serial.protocol_handler_packages:
        serial.protocol_handler_packages.append(_STAND_IN)
    try:
        port: Port = serial.serial_for_url(url, baudrate=baud, timeout=timeout_s, write_timeout=timeout_s)
    except (OSError, ValueError) as error:
        raise PortError(
            f"cannot open {url} at {baud} baud: {error}; check the name, the rights and the table"
        ) from error
    return port
