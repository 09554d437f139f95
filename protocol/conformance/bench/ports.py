"""Open the port of the table under test."""

from pathlib import Path

from protocol.conformance.bench.wire import ReopenablePort
from protocol.conformance.profile.profile import Profile

_STAND_IN_PACKAGE = "emulator"
"""Where pyserial looks for the emulator's URL scheme, `emulator://`. The emulator need not be installed."""


class SessionError(Exception):
    """The device at the port cannot be tested. The message states why, and the next step."""


def open_port(url: str, profile: Profile) -> ReopenablePort:
    """Open a device or any pyserial URL, at the profile's rate. A lock keeps out other processes of this kit.

    Raises:
        SessionError: the port cannot be opened.
    """
    import serial  # noqa: PLC0415 - the pytest plug-in is loaded by runs that need no port

    from protocol.serial_port import open_serial_port  # noqa: PLC0415 - for the same reason

    if _STAND_IN_PACKAGE not in serial.protocol_handler_packages:
        serial.protocol_handler_packages.append(_STAND_IN_PACKAGE)
    timeout_s = profile.serial.timeout_s
    try:
        port: ReopenablePort = open_serial_port(url, profile.serial.baud or 9600, timeout_s, exclusive=True)
    except (OSError, ValueError) as error:
        raise SessionError(
            f"cannot open {url}: {error}; check the port name, permissions (dialout group) and power"
        ) from error
    return port


def is_simulated(port: object) -> bool:
    """Return whether the port has its own clock: then the table is simulated."""
    return getattr(port, "clock", None) is not None


def described(url: str) -> str:
    """Return the device that a URL names, with symbolic links resolved."""
    path = Path(url)
    return f"{url} ({path.resolve()})" if path.is_symlink() else url
