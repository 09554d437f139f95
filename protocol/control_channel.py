"""The client of an emulator's control channel: JSON lines in both directions over a Unix socket.

A request is `{"command": NAME, PARAMETER: NUMBER, ...}`. Its reply is `{"ok": true, ...}` or `{"ok": false, "error":
SENTENCE}`. `emulator.server.control_commands` defines the commands.
"""

import json
import socket
from pathlib import Path
from typing import Any, NamedTuple, TypeVar

from protocol.bench import BenchError, Fault, TableFacts, TableStatus
from protocol.clock import WallClock

TIMEOUT_S = 5.0
"""Maximum time until the last byte of a reply."""

_LONGEST_ANSWER = 1 << 16

_Seen = TypeVar("_Seen", bound=NamedTuple)


def request(path: Path, command: str, timeout_s: float = TIMEOUT_S, **parameters: float) -> dict[str, Any]:
    """Return the fields of the reply to one command, without `ok`.

    Raises:
        BenchError: no reply from `path` in time, the reply is not from an emulator, or the emulator refuses the
            request.
    """
    line = json.dumps({"command": command, **parameters}).encode() + b"\n"
    try:
        reply = _exchange(path, line, timeout_s)
    except (OSError, ValueError) as error:
        raise BenchError(f"{path}: {error}; is this the --control socket of a running emulator?") from error
    fields = _fields_of(reply)
    if fields.pop("ok", None) is True:
        return fields
    if not isinstance(sentence := fields.get("error"), str):
        raise _no_answer(path, reply)
    raise BenchError(sentence)


class ControlChannel:
    """The bench of an emulator in another process.

    Args:
        path: the emulator's control socket.
        timeout_s: maximum time for a reply.

    Raises:
        BenchError: no emulator replies there.
    """

    def __init__(self, path: Path, timeout_s: float = TIMEOUT_S) -> None:
        self._path, self._timeout_s = path, timeout_s
        self.status()

    @property
    def facts(self) -> TableFacts:
        """The table's constants."""
        return self._seen(TableFacts, "facts")

    def status(self) -> TableStatus:
        """Return the present state of the table."""
        return self._seen(TableStatus, "state")

    def trigger(self) -> None:
        """Latch the position now, as the probe's trigger signal does."""
        self._request("trigger")

    def set_load_torque(self, torque_Nm: float) -> None:
        """Apply a load torque that opposes positive rotation, until the next call."""
        self._request("load-torque", torque_Nm=torque_Nm)

    def reset(self, count: int = 0) -> None:
        """Cut the table's power and switch it on again; its counter starts at `count`."""
        self._request("preset", count=count)

    def inject(self, fault: Fault) -> None:
        """Inject a fault, now or at the time that the fault specifies."""
        self._request(f"fault-{fault.kind}", **fault.numbers())

    def clear_faults(self) -> None:
        """End all faults and cancel the scheduled ones."""
        self._request("clear-faults")

    def set_time_scale(self, time_scale: float) -> None:
        """Set the time scale: simulated time divided by real time."""
        self._request("time-scale", time_scale=time_scale)

    def quit(self) -> None:
        """End the emulator, as SIGTERM does."""
        self._request("quit")

    def _request(self, command: str, **parameters: float) -> dict[str, Any]:
        return request(self._path, command, self._timeout_s, **parameters)

    def _seen(self, kind: type[_Seen], command: str) -> _Seen:
        """Return the status in a reply. Each value must have the type of its field."""
        fields = self._request(command)
        values = [fields.get(name) for name in kind._fields]
        for value, wanted in zip(values, kind.__annotations__.values(), strict=True):
            if not isinstance(value, int | float if wanted is float else wanted) or isinstance(value, bool):
                raise _no_answer(self._path, json.dumps(fields).encode())
        return kind._make(values)


def _exchange(path: Path, line: bytes, timeout_s: float) -> bytes:
    """Send a line, and return the reply up to its line feed, or the part that was received."""
    if not hasattr(socket, "AF_UNIX"):
        raise OSError("this system has no Unix sockets, so no control channel")
    clock, answer = WallClock(), b""
    deadline_s = clock.now_s() + timeout_s
    with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as connection:
        connection.settimeout(timeout_s)
        connection.connect(str(path))
        connection.sendall(line)
        while not answer.endswith(b"\n") and len(answer) < _LONGEST_ANSWER:
            if (left_s := deadline_s - clock.now_s()) <= 0.0:
                raise TimeoutError("timed out")
            connection.settimeout(left_s)
            if not (piece := connection.recv(_LONGEST_ANSWER)):
                break
            answer += piece
    return answer


def _fields_of(reply: bytes) -> dict[str, Any]:
    """Return the fields of a reply; none if it is not a JSON object."""
    try:
        fields = json.loads(reply)
    except (ValueError, RecursionError):
        return {}
    return fields if isinstance(fields, dict) else {}


def _no_answer(path: Path, reply: bytes) -> BenchError:
    if not reply:
        return BenchError(f"{path}: the emulator closed the connection without a reply")
    return BenchError(f"{path}: {reply[:80]!r} is not a reply of an emulator; is this its control channel?")
