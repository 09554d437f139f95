"""The client's end of the wire: one method for each verb, and waiting for arrival."""

from collections.abc import Callable
from decimal import Decimal
from types import TracebackType
from typing import Self

from protocol.dialogue import Dialogue
from protocol.errors import ArrivalTimeout, PortError, ProtocolMisuse, TableError
from protocol.messages import Angle, Command, Verb
from protocol.port import Port
from protocol.stopping import BRAKING_DEG_S2, stop

POLL_INTERVAL_S = 0.05


class TableClient:
    """A rotary table at the other end of a port. Not for use by several threads at once.

    Leaving the `with` block closes the port; the motion that is running goes on. Every command raises a `TableError`
    when the table or the line fails, and `ProtocolMisuse` for a number that cannot be sent. After a failure the
    client can be used on: it makes sure of its place before the next command.

    Attributes:
        port: the port.
        clock: the clock that the port carries, else the wall clock.
    """

    def __init__(
        self, port: Port, timeout_s: float = 1.0, decimals: int = 1, braking_deg_s2: float = BRAKING_DEG_S2
    ) -> None:
        """Take over an open port; nothing is sent before the first command.

        Args:
            port: an open pyserial port or its like; its read time-out is set here, its `clock` is used if it has one.
            timeout_s: how long to wait for a reply.
            decimals: decimal places of the numbers sent.
            braking_deg_s2: the greatest A to stop a table with that has not accepted one from this client.
        """
        self.port = port
        self._braking_deg_s2 = braking_deg_s2
        self._dialogue = Dialogue(port, timeout_s, decimals)
        self.clock = self._dialogue.clock

    @classmethod
    def open(cls, url: str, baud: int = 9600, timeout_s: float = 1.0, decimals: int = 1) -> Self:
        """Open a device or any URL of pyserial's: `/dev/ttyUSB0`, `rfc2217://localhost:7000`.

        Once the package `emulator` is imported, `emulator://` too.

        Raises:
            PortError: the port cannot be opened.
        """
        # Here, since the emulator shares this package and starts without pyserial.
        from protocol.serial_port import open_serial_port  # noqa: PLC0415  # see above

        try:
            port = open_serial_port(url, baud, timeout_s)
        except (OSError, ValueError) as error:
            raise PortError(
                f"cannot open {url} at {baud} baud: {error}; check the port name, permissions (dialout group) and power"
            ) from error
        return cls(port, timeout_s, decimals)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        self.close()

    def close(self) -> None:
        """Close the port."""
        self.port.close()

    def position_deg(self) -> float:
        """Return the present position, as the encoder has it (H)."""
        return float(self._read(Verb.READ_POSITION))

    def latched_deg(self) -> float:
        """Return the position latched at the probe's last trigger (L)."""
        return float(self._read(Verb.READ_LATCH))

    def move_to(self, angle_deg: float | Decimal) -> None:
        """Start to move to a position on the unwrapped axis, replacing a motion that is running (P)."""
        self._dialogue.exchange(Command(Verb.MOVE_TO, _decimal(angle_deg)))

    def move_by(self, angle_deg: float | Decimal) -> None:
        """Start to move by an increment to the reference position, replacing a motion that is running (R)."""
        self._dialogue.exchange(Command(Verb.MOVE_BY, _decimal(angle_deg)))

    def set_speed(self, speed_deg_s: float | Decimal) -> None:
        """Set the top speed from the next motion on (S)."""
        self._dialogue.exchange(Command(Verb.SET_SPEED, _decimal(speed_deg_s)))

    def set_acceleration(self, acceleration_deg_s2: float | Decimal) -> None:
        """Set the acceleration from the next motion on (A)."""
        self._dialogue.exchange(Command(Verb.SET_ACCELERATION, _decimal(acceleration_deg_s2)))

    def stop(self) -> float:
        """Brake with the greatest A that the table has accepted, wait until it stands, and return where (H).

        See `protocol.stopping`. S and A are those of before afterwards, where they are known.

        Raises:
            NotStopped: it was not seen to stand; the message says why, and what it will do.
        """
        return stop(self._dialogue, self._braking_deg_s2)

    def stop_and_report(self) -> str:
        """Stop the table, and return in words where it stands, or why it may not stand and what it will do."""
        try:
            return f"the table was stopped, and stands at {self.stop():.6g} deg"
        except TableError as error:
            return str(error)

    def wait_until_at(
        self,
        angle_deg: float | Decimal,
        tolerance_deg: float | Decimal = 0.05,
        timeout_s: float = 60.0,
        progress: Callable[[float], None] | None = None,
    ) -> float:
        """Poll the position until two readings in a row are within the tolerance, and return the last.

        One reading could be that of a table which passes by.

        Args:
            angle_deg: where the table is expected.
            tolerance_deg: the greatest difference that counts as being there.
            timeout_s: how long to wait.
            progress: called with each position read.

        Raises:
            ArrivalTimeout: the table is not there in time; it is not stopped.
        """
        target, tolerance = _decimal(angle_deg), _decimal(tolerance_deg)
        deadline_s = self.clock.now_s() + timeout_s
        readings_there = 0
        while True:
            position = self._read(Verb.READ_POSITION)
            if progress is not None:
                progress(float(position))
            readings_there = readings_there + 1 if abs(position - target) <= tolerance else 0
            if readings_there == 2:
                self._dialogue.rests_at(float(position))
                return float(position)
            if self.clock.now_s() >= deadline_s:
                raise ArrivalTimeout(
                    f"waited {timeout_s:g} s for {target} +- {tolerance} deg, the table stands at {position} deg;"
                    " check that it was sent there and turns freely, or allow more time",
                    float(position),
                )
            self.clock.sleep_s(POLL_INTERVAL_S)

    def _read(self, verb: Verb) -> Decimal:
        reply = self._dialogue.exchange(Command(verb))
        assert isinstance(reply, Angle)
        return reply.angle_deg


def _decimal(value: float | Decimal) -> Decimal:
    """Return a number as its user wrote it: 12.35 is 12.35, not the binary fraction next to it."""
    number = value if isinstance(value, Decimal) else Decimal(repr(float(value)))
    if not number.is_finite():
        raise ProtocolMisuse(f"{value} is not a finite number")
    return number
