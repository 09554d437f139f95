"""The controller in simavr: flash in, a control tick at a time, pins and memory out."""

import ctypes
import struct
from collections.abc import Sequence
from functools import cache

from emulator.avr.elf import DATA_SPACE, Program
from emulator.avr.errors import ChipError, ToolchainError
from emulator.avr.toolchain import build_simulator

_MOST_SENT = 256
_RAM_END = 0x900
_FAILURES = {
    -1: "its tick did not come",
    -2: "its program crashed",
    -3: "more edges, bytes and triggers came in a tick than the simulator holds",
}


class _Shown(ctypes.Structure):
    """The beginning of `struct chip` in `host/chip.c`."""

    _fields_ = (
        ("duty", ctypes.c_int32),
        ("longest_tick", ctypes.c_uint32),
        ("lost_edges", ctypes.c_uint32),
        ("duty_changes", ctypes.c_uint32),
        ("overrun_bytes", ctypes.c_uint32),
        ("pwm_steps", ctypes.c_int32),
        ("line_count", ctypes.c_int32),
        ("sent_count", ctypes.c_uint32),
        ("sent", ctypes.c_uint8 * _MOST_SENT),
    )


class Chip:
    """An ATmega328P that has just been switched on, and has run to its first tick."""

    def __init__(self, program: Program, tick_hz: int, bit_cycles: int, wake_count: int = 0) -> None:
        """Load a program, and start its encoder's counter at `wake_count`, as a debugger can."""
        self._program = program
        self._library = _library()
        self._chip = self._library.chip_new(program.flash, len(program.flash), tick_hz, bit_cycles)
        if not self._chip:
            raise ChipError("simavr has no ATmega328P, or the program is too large for one")
        self._shown = ctypes.cast(self._chip, ctypes.POINTER(_Shown)).contents
        self._check(
            self._library.chip_start(
                self._chip, program.symbols["main"], program.symbols["wake_count"] - DATA_SPACE, wake_count
            )
        )

    def __del__(self) -> None:
        if getattr(self, "_chip", None):
            self._library.chip_free(self._chip)
            self._chip = None

    def tick(
        self,
        start: float,
        straight: float,
        end: float,
        edges: int,
        arriving: bytes = b"",
        triggers: Sequence[float] = (),
    ) -> None:
        """Run to the next tick.

        Args:
            start: where the shaft is, in counts.
            straight: how far it would go at its present speed.
            end: where it is at the next tick.
            edges: what the encoder counts on this way.
            arriving: bytes that are over in this tick.
            triggers: shares (0..1) of the tick at which the trigger's edge comes.

        Raises:
            ChipError: the controller does not go on.
        """
        shares = (ctypes.c_double * len(triggers))(*triggers) if triggers else None
        self._check(
            self._library.chip_tick(
                self._chip, start, straight, end, edges, arriving, len(arriving), shares, len(triggers)
            )
        )

    def idle(self, most_ticks: int) -> int:
        """Run ticks in which nothing comes from outside, until the bridge has a duty; return how many."""
        return self._check(self._library.chip_idle(self._chip, most_ticks))

    def trigger(self) -> None:
        """Put an edge on the trigger now."""
        self._library.chip_trigger(self._chip)

    def unguard(self) -> None:
        """Let events come at any cycle, also while a tick is sampled: then its count is right to one edge."""
        self._library.chip_unguard(self._chip)

    def settle(self) -> None:
        """Let the tick that has begun come to its end, so that `memory` shows it."""
        self._library.chip_settle(self._chip)

    @property
    def duty(self) -> int:
        """The duty on the bridge in the coming tick, in PWM steps."""
        return int(self._shown.duty)

    @property
    def longest_tick(self) -> int:
        """The cycles of the longest tick, interrupts included."""
        return int(self._shown.longest_tick)

    @property
    def lost_edges(self) -> int:
        """Edges of the encoder whose interrupt still waited for the one before."""
        return int(self._shown.lost_edges)

    @property
    def duty_changes(self) -> int:
        """Ticks amid which the duty on the bridge became another."""
        return int(self._shown.duty_changes)

    @property
    def overrun_bytes(self) -> int:
        """Bytes for which the hardware had no room."""
        return int(self._shown.overrun_bytes)

    @property
    def pwm_steps(self) -> int:
        """The steps of a PWM period: the duty that is fully on."""
        return int(self._shown.pwm_steps)

    @property
    def is_sending(self) -> bool:
        """Whether a byte is on its way out."""
        return bool(self._shown.line_count)

    @property
    def stack_bytes(self) -> int:
        """The deepest that the stack has been: memory that was never used is 0."""
        size = _RAM_END - (self._program.symbols["_end"] - DATA_SPACE)
        return len(self.memory("_end", size).lstrip(b"\0"))

    def take_sent(self) -> bytes:
        """Return and remove the bytes whose stop bit has been sent."""
        count = self._shown.sent_count
        if not count:
            return b""
        self._shown.sent_count = 0
        return bytes(self._shown.sent[:count])

    def memory(self, symbol: str, size: int) -> bytes:
        """Return the memory of a variable."""
        data = ctypes.create_string_buffer(size)
        self._library.chip_read(self._chip, self._program.symbols[symbol] - DATA_SPACE, data, size)
        return data.raw

    def number(self, symbol: str, layout: str) -> int:
        """Return a variable of a layout of the module struct."""
        return int(struct.unpack(layout, self.memory(symbol, struct.calcsize(layout)))[0])

    def _check(self, result: int) -> int:
        if result < 0:
            raise ChipError(f"the simulated controller does not go on: {_FAILURES.get(result, str(result))}")
        return result


@cache
def _library() -> ctypes.CDLL:
    path = build_simulator()
    try:
        library = ctypes.CDLL(str(path))
    except OSError as error:
        raise ToolchainError(f"{path}: {error}; install the package libsimavr-dev") from error
    handle, text, number, real = ctypes.c_void_p, ctypes.c_char_p, ctypes.c_uint32, ctypes.c_double
    shapes = {
        "chip_new": (handle, [text, number, number, number]),
        "chip_free": (None, [handle]),
        "chip_start": (ctypes.c_int, [handle, number, ctypes.c_uint16, ctypes.c_int32]),
        "chip_tick": (
            ctypes.c_int,
            [handle, real, real, real, ctypes.c_int32, text, number, ctypes.POINTER(real), number],
        ),
        "chip_idle": (ctypes.c_int, [handle, number]),
        "chip_settle": (None, [handle]),
        "chip_trigger": (None, [handle]),
        "chip_unguard": (None, [handle]),
        "chip_read": (None, [handle, ctypes.c_uint16, text, ctypes.c_uint16]),
    }
    for name, (result, arguments) in shapes.items():
        function = getattr(library, name)
        function.restype, function.argtypes = result, arguments
    return library
