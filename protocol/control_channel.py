"""The client of an emulator's control channel: a line of JSON each way, over a Unix socket.

A request is `{"command": NAME, PARAMETER: NUMBER, ...}`. Its answer is `{"ok": true, ...}` or
`{"ok": false, "error": SENTENCE}`. `emulator.server.control_commands` has the commands.
"""

import json
import socket
from pathlib import Path
from typing import Any, NamedTuple, TypeVar

from protocol.bench import BenchError, Fault, TableFacts, TableStatus
from protocol.clock import WallClock

TIMEOUT_S = 5.0
"""How long an answer may take, to its last byte."""

_LONGEST_ANSWER = 1 << 16

_Seen = TypeVar("_Seen", bound=NamedTuple)


def request(path: Path, command: str, timeout_s: float = TIMEOUT_S, **parameters: float) -> dict[str, Any]:
    """Return what the answer to one command says beyond `ok`.

    Raises:
        BenchError: nobody answers at `path` in time, something else answers there, or the request is refused.
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
        timeout_s: how long an answer may take.

    Raises:
        BenchError: no emulator answers there.
    """

    def __init__(self, path: Path, timeout_s: float = TIMEOUT_S) -> None:
        self._path, self._timeout_s = path, timeout_s
        self.status()

    @property
    def facts(self) -> TableFacts:
        """The table's constants."""
        return self._seen(TableFacts, "facts")

    def status(self) -> TableStatus:
        """Return the table as it is at this moment."""
        return self._seen(TableStatus, "state")

    def trigger(self) -> None:
        """Latch the position at this moment, as the probe's signal does."""
        self._request("trigger")

    def set_load_torque(self, torque_Nm: float) -> None:
        """Load the table with a torque that resists positive rotation, until it is set anew."""
        self._request("load-torque", torque_Nm=torque_Nm)

    def reset(self, count: int = 0) -> None:
        """Cut the table's power and switch it on again; its counter begins at `count`."""
        self._request("preset", count=count)

    def inject(self, fault: Fault) -> None:
        """Let something go wrong, now or when the fault says."""
        self._request(f"fault-{fault.kind}", **fault.numbers())

    def clear_faults(self) -> None:
        """End all faults, and forget those to come."""
        self._request("clear-faults")

    def set_time_scale(self, time_scale: float) -> None:
        """Let simulated time pass at another rate: simulated seconds in a real one."""
        self._request("time-scale", time_scale=time_scale)

    def quit(self) -> None:
        """End the emulator, as SIGTERM does."""
        self._request("quit")

    def _request(self, command: str, **parameters: float) -> dict[str, Any]:
        return request(self._path, command, self._timeout_s, **parameters)

    def _seen(self, kind: type[_Seen], command: str) -> _Seen:
        """Return what an answer shows of the table, once each value is of the type that belongs there."""
        fields = self._request(command)
        values = [fields.get(name) for name in kind._fields]
        for value, wanted in zip(values, kind.__annotations__.values(), strict=True):
            if not isinstance(value, int | float if wanted is float else wanted) or isinstance(value, bool):
                raise _no_answer(self._path, json.dumps(fields).encode())
        return kind._make(values)


def _exchange(path: Path, line: bytes, timeout_s: float) -> bytes:
    """Send a line and return the answer, to its line feed or as far as it came."""
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
    """Return the fields of an answer; none where it is no JSON object."""
    try:
        fields = json.loads(reply)
    except (ValueError, RecursionError):
        return {}
    return fields if isinstance(fields, dict) else {}


def _no_answer(path: Path, reply: bytes) -> BenchError:
    if not reply:
        return BenchError(f"{path}: the emulator closed the connection without an answer")
    return BenchError(f"{path}: {reply[:80]!r} is not an answer of an emulator; is this its control channel?")
