"""Open the port of a table."""

import serial

from protocol import Clock, Port, PortError, WallClock
from protocol.serial_port import open_serial_port

# pyserial finds the emulator's URL scheme `emulator://` if the emulator is installed; nothing else of it is used here.
_STAND_IN = "emulator"

CONTROL_TIMEOUT_S = 1.0
"""Maximum time for a reply of the control channel while the table moves."""


class ScaledClock:
    """The time of an emulator that runs faster or slower than real time."""

    def __init__(self, clock: Clock, time_scale: float) -> None:
        """Count `time_scale` seconds for each second of `clock`."""
        self._clock, self._time_scale = clock, time_scale

    def now_s(self) -> float:
        """Return the emulator's time since an arbitrary, fixed moment."""
        return self._clock.now_s() * self._time_scale

    def sleep_s(self, duration_s: float) -> None:
        """Return after this much of the emulator's time."""
        self._clock.sleep_s(duration_s / self._time_scale)


def open_port(url: str, baud: int, timeout_s: float, time_scale: float = 1.0) -> Port:
    """Return an open port: a device, or any pyserial URL.

    Args:
        url: the device or URL.
        baud: bits per second.
        timeout_s: timeout for reading and writing.
        time_scale: time scale of the emulator behind the port; the port's clock has the same scale.

    Raises:
        PortError: the port cannot be opened.
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
