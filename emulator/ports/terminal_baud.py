"""The baud rate of a terminal device, including nonstandard rates (POSIX only)."""

import fcntl
import struct
import sys
import termios

# Linux stores any rate as a number in struct termios2: four flag words, the line discipline and 19 control characters,
# then input and output rate. These request codes are valid for x86, ARM and RISC-V.
_TERMIOS2 = struct.Struct("4I20s2I")
_TCGETS2 = 0x802C542A
_TCSETS2 = 0x402C542B
_RATE_MASK = 0o010017
_RATE_IS_A_NUMBER = 0o010000

_RATE_CODES = {int(name[1:]): getattr(termios, name) for name in dir(termios) if name[0] == "B" and name[1:].isdigit()}
_INPUT_RATE, _OUTPUT_RATE = 4, 5  # indices in the list of termios.tcgetattr


def get_baud(descriptor: int) -> int:
    """Return the rate in baud that a terminal is set to, or 0 if it cannot be read."""
    if sys.platform == "linux":
        try:
            *_, baud = _TERMIOS2.unpack(fcntl.ioctl(descriptor, _TCGETS2, bytes(_TERMIOS2.size)))
        except OSError:
            pass
        else:
            return int(baud)
    code = termios.tcgetattr(descriptor)[_OUTPUT_RATE]
    return next((baud for baud, known in _RATE_CODES.items() if known == code), 0)


def set_baud(descriptor: int, baud: int) -> None:
    """Set a terminal to a rate in baud.

    Raises:
        OSError: the system cannot set this rate.
    """
    if baud in _RATE_CODES:
        settings = termios.tcgetattr(descriptor)
        settings[_INPUT_RATE] = settings[_OUTPUT_RATE] = _RATE_CODES[baud]
        termios.tcsetattr(descriptor, termios.TCSANOW, settings)
        return
    if sys.platform != "linux":
        raise OSError(f"this system cannot set a terminal to {baud} baud")
    settings2 = list(_TERMIOS2.unpack(fcntl.ioctl(descriptor, _TCGETS2, bytes(_TERMIOS2.size))))
    settings2[2] = settings2[2] & ~_RATE_MASK | _RATE_IS_A_NUMBER
    settings2[-2:] = [baud, baud]
    fcntl.ioctl(descriptor, _TCSETS2, _TERMIOS2.pack(*settings2))
