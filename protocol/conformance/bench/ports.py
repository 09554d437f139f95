"""Opening the port of the table under test."""

from pathlib import Path

from protocol.conformance.bench.wire import ReopenablePort
from protocol.conformance.profile.profile import Profile

_STAND_IN_PACKAGE = "emulator"
"""Where pyserial looks for the emulator's own kind of URL, `emulator://`; it need not be installed."""


class SessionError(Exception):
    """What is at the port cannot be tested; the message says why and what to do."""


def open_port(url: str, profile: Profile) -> ReopenablePort:
    """Open a device or any URL of pyserial's, at the profile's rate, with a lock that keeps out others of this kit.

    Raises:
        SessionError: it cannot be opened.
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
    """Return whether the port carries its own clock: then nothing real moves behind it."""
    return getattr(port, "clock", None) is not None


def described(url: str) -> str:
    """Return what device a URL leads to, links followed."""
    path = Path(url)
    return f"{url} ({path.resolve()})" if path.is_symlink() else url
