"""Open the port at which a table is."""

import serial

from protocol import Clock, Port, PortError, WallClock
from protocol.serial_port import open_serial_port

# The emulator's port `emulator://` is found by pyserial wherever the emulator is installed; nothing of it is used here.
_STAND_IN = "emulator"

CONTROL_TIMEOUT_S = 1.0
"""How long a control channel may take to answer while the table moves."""


class ScaledClock:
    """The time of an emulator that runs faster or slower than real."""

    def __init__(self, clock: Clock, time_scale: float) -> None:
        """Count `time_scale` seconds in each of `clock`'s."""
        self._clock, self._time_scale = clock, time_scale

    def now_s(self) -> float:
        """Return the emulator's seconds since an arbitrary but fixed moment."""
        return self._clock.now_s() * self._time_scale

    def sleep_s(self, duration_s: float) -> None:
        """Return when so much of the emulator's time has passed."""
        self._clock.sleep_s(duration_s / self._time_scale)


def open_port(url: str, baud: int, timeout_s: float, time_scale: float = 1.0) -> Port:
    """Return an open port: a device, or any URL of pyserial's.

    Args:
        url: what to open.
        baud: bits a second.
        timeout_s: for reading and writing.
        time_scale: time scale of the emulator behind the port; the port's clock then runs like the emulator's.

    Raises:
        PortError: it cannot be opened.
    """
    if _STAND_IN not in serial.protocol_handler_packages:
        serial.protocol_handler_packages.append(_STAND_IN)
    try:
        port: Port = open_serial_port(url, baud, timeout_s)
    except (OSError, ValueError) as error:
        raise PortError(
            f"cannot open {url} at {baud} baud: {error}; check the port name, permissions (dialout group) and power"
        ) from error
    if time_scale != 1.0:
        port.clock = ScaledClock(WallClock(), time_scale)  # type: ignore[attr-defined] # where clients look for one
    return port
