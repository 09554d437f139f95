"""The client of the protocol: one method for each verb, and a wait for arrival."""

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
    """A rotary table at the other end of a port. It must not be used by several threads at once.

    Leaving the `with` block closes the port; a running motion continues. Every command raises a `TableError` when the
    table or the line fails, and `ProtocolMisuse` for a number that cannot be sent. The client can still be used after a
    failure: it resynchronizes before the next command.

    Attributes:
        port: the port.
        clock: the clock of the port if it has one, else the wall clock.
    """

    def __init__(
        self, port: Port, timeout_s: float = 1.0, decimals: int = 1, braking_deg_s2: float = BRAKING_DEG_S2
    ) -> None:
        """Use an open port. Nothing is sent before the first command.

        Args:
            port: an open pyserial port, or an object that behaves like one. Its read timeout is set here. Its `clock`
                is used if it has one.
            timeout_s: maximum time to wait for a reply.
            decimals: decimal places of the numbers sent.
            braking_deg_s2: the maximum A that `stop` tries when the table has not yet accepted an A from this client.
        """
        self.port = port
        self._braking_deg_s2 = braking_deg_s2
        self._dialogue = Dialogue(port, timeout_s, decimals)
        self.clock = self._dialogue.clock

    @classmethod
    def open(cls, url: str, baud: int = 9600, timeout_s: float = 1.0, decimals: int = 1) -> Self:
        """Open a device or any pyserial URL, such as `/dev/ttyUSB0` or `rfc2217://localhost:7000`.

        `emulator://` works too, once the package `emulator` is imported.

        Raises:
            PortError: the port cannot be opened.
        """
        # Imported here because the emulator shares this package and starts without pyserial.
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
        """Return the present position, as the encoder measures it (H)."""
        return float(self._read(Verb.READ_POSITION))

    def latched_deg(self) -> float:
        """Return the position latched at the last trigger of the probe (L)."""
        return float(self._read(Verb.READ_LATCH))

    def move_to(self, angle_deg: float | Decimal) -> None:
        """Start a motion to a position on the unwrapped axis. It replaces a running motion (P)."""
        self._dialogue.exchange(Command(Verb.MOVE_TO, _decimal(angle_deg)))

    def move_by(self, angle_deg: float | Decimal) -> None:
        """Start a motion by an increment to the reference position. It replaces a running motion (R)."""
        self._dialogue.exchange(Command(Verb.MOVE_BY, _decimal(angle_deg)))

    def set_speed(self, speed_deg_s: float | Decimal) -> None:
        """Set the maximum speed of the following motions (S)."""
        self._dialogue.exchange(Command(Verb.SET_SPEED, _decimal(speed_deg_s)))

    def set_acceleration(self, acceleration_deg_s2: float | Decimal) -> None:
        """Set the acceleration of the following motions (A)."""
        self._dialogue.exchange(Command(Verb.SET_ACCELERATION, _decimal(acceleration_deg_s2)))

    def stop(self) -> float:
        """Brake with the maximum A that the table has accepted, wait for standstill, and return the position (H).

        See `protocol.stopping`. Afterwards S and A have their former values, if those are known.

        Raises:
            NotStopped: standstill was not observed. The message states why, and what the table will do.
        """
        return stop(self._dialogue, self._braking_deg_s2)

    def stop_and_report(self) -> str:
        """Stop the table. Return as text where it stands, or why it may still move and what it will do."""
        try:
            return f"the table was stopped and stands at {self.stop():.6g} deg"
        except TableError as error:
            return str(error)

    def wait_until_at(
        self,
        angle_deg: float | Decimal,
        tolerance_deg: float | Decimal = 0.05,
        timeout_s: float = 60.0,
        progress: Callable[[float], None] | None = None,
    ) -> float:
        """Poll the position until two consecutive readings are within the tolerance, and return the last one.

        A single reading could come from a table that passes the target.

        Args:
            angle_deg: expected position of the table.
            tolerance_deg: maximum difference that counts as arrived.
            timeout_s: maximum time to wait.
            progress: called with each position read.

        Raises:
            ArrivalTimeout: the table did not arrive in time. It is not stopped.
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
                    f"waited {timeout_s:g} s for {target} +- {tolerance} deg; the table is at {position} deg;"
                    " check that it was sent there and turns freely, or allow more time",
                    float(position),
                )
            self.clock.sleep_s(POLL_INTERVAL_S)

    def _read(self, verb: Verb) -> Decimal:
        reply = self._dialogue.exchange(Command(verb))
        assert isinstance(reply, Angle)
        return reply.angle_deg


def _decimal(value: float | Decimal) -> Decimal:
    """Return a number as its user wrote it: 12.35 stays 12.35, not the nearest binary fraction."""
    number = value if isinstance(value, Decimal) else Decimal(repr(float(value)))
    if not number.is_finite():
        raise ProtocolMisuse(f"{value} is not a finite number")
    return number
