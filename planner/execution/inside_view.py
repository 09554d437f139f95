"""What a stand-in tells beyond the wire, where there is one: its reference, its true angle, and a trigger to pull.

A real table has none of this; there the probe pulls the trigger by itself. Nothing here is needed to run a plan.
"""

import json
import socket
from pathlib import Path
from typing import Any, NamedTuple, Protocol

from planner.errors import PlannerError

_TIMEOUT_S = 1.0


class Look(NamedTuple):
    """One look at a table from inside, in degrees; the true angle is the table's own, behind the backlash."""

    reference_deg: float
    encoder_deg: float
    true_deg: float


class InsideView(Protocol):
    """A table that can be looked into."""

    def look(self) -> Look:
        """Return where the table is at this moment."""
        ...

    def trigger(self) -> None:
        """Latch the position at this moment, as the probe's signal does."""
        ...


class PortView:
    """The table behind a port that carries it as `port.table`: a simulated one in this process."""

    def __init__(self, table: Any) -> None:  # noqa: ANN401 - the planner knows nothing of the stand-in's types
        self._table = table

    def look(self) -> Look:
        """Return where the table is at this moment."""
        status = self._table.status()
        return Look(status.reference_deg, status.encoder_deg, status.true_deg)

    def trigger(self) -> None:
        """Latch the position at this moment."""
        self._table.trigger()


class ControlView:
    """A stand-in that runs on its own, through its control channel: a line of JSON for each question and answer."""

    def __init__(self, path: Path) -> None:
        """Connect to the socket at `path`.

        Raises:
            PlannerError: nobody listens there.
        """
        self._path = path
        self._socket = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
        self._socket.settimeout(_TIMEOUT_S)
        try:
            self._socket.connect(str(path))
        except OSError as error:
            self._socket.close()
            raise self._silent(error) from error
        self._replies = self._socket.makefile("rb")

    def look(self) -> Look:
        """Return where the table is at this moment."""
        state = self._ask("state")
        return Look(state["reference_deg"], state["encoder_deg"], state["true_deg"])

    def trigger(self) -> None:
        """Latch the position at this moment."""
        self._ask("trigger")

    def close(self) -> None:
        """Hang up."""
        self._replies.close()
        self._socket.close()

    def _ask(self, command: str) -> dict[str, Any]:
        try:
            self._socket.sendall(json.dumps({"command": command}).encode() + b"\n")
            answer: dict[str, Any] = json.loads(self._replies.readline())
        except (OSError, ValueError, RecursionError) as error:
            raise self._silent(error) from error
        return answer

    def _silent(self, error: Exception) -> PlannerError:
        return PlannerError(
            f"{self._path}: no stand-in answers on its control channel ({error}); start it with --control"
        )


def view_of(port: object) -> InsideView | None:
    """Return the view into the table of a port that carries one, else None."""
    table = getattr(port, "table", None)
    return None if table is None else PortView(table)
