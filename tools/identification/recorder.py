"""Run the excitation on a table and poll its position meanwhile, over any port."""

from collections.abc import Callable
from contextlib import suppress

import numpy as np

from protocol.client import TableClient
from protocol.errors import TableError
from tools.identification.excitation import Turn
from tools.identification.recording import Sent, WireRecording

_BITS_A_BYTE = 10


def record(
    client: TableClient,
    turns: list[Turn],
    speed_deg_s: float,
    baud: int,
    progress: Callable[[float], None] = lambda _: None,
) -> WireRecording:
    """Return what the table answers while it makes the turns; it is brought back to its start afterwards.

    Args:
        client: A client that no one else uses, sending one decimal.
        turns: From `excitation`.
        speed_deg_s: The top speed, which no turn reaches.
        baud: Of the line: a command counts from when it is complete at the table.
        progress: Called with the share that is done.

    Raises:
        TableError: The table refused a command, or went silent; it has been told to stop.
    """
    home_deg = round(client.position_deg(), 1)
    client.move_to(home_deg)
    client.wait_until_at(home_deg)
    recorder = _Recorder(client, baud)
    reach_deg = 2.0 * max(turn.acceleration_deg_s2 * turn.duration_s**2 for turn in turns)
    length_s = sum(turn.duration_s for turn in turns)
    try:
        end_s = 0.0
        for turn in turns:
            end_s += turn.duration_s
            recorder.send("S", speed_deg_s)
            recorder.send("A", turn.acceleration_deg_s2)
            recorder.send("P", home_deg + turn.direction * reach_deg)
            while recorder.now_s() < end_s:
                recorder.read()
            progress(min(end_s / length_s, 1.0))
        client.move_to(home_deg)
    except BaseException:
        with suppress(TableError):
            client.stop()
        raise
    client.wait_until_at(home_deg)
    return recorder.recording()


class _Recorder:
    """Notes what is said, and when each line was complete at the table."""

    def __init__(self, client: TableClient, baud: int) -> None:
        self._client = client
        self._byte_s = _BITS_A_BYTE / baud if baud else 0.0
        self._start_s = client.clock.now_s()
        self._commands: list[Sent] = []
        self._times_s: list[float] = []
        self._positions_deg: list[float] = []
        self._last_values: dict[str, float] = {}

    def now_s(self) -> float:
        return self._client.clock.now_s() - self._start_s

    def send(self, verb: str, value: float) -> None:
        """Send a command; S and A only when their value is a new one."""
        value = round(value, 1)
        if verb != "P" and self._last_values.get(verb) == value:
            return
        self._last_values[verb] = value
        time_s = self.now_s() + self._byte_s * len(f"{verb} {value:.1f}\r")
        {"S": self._client.set_speed, "A": self._client.set_acceleration, "P": self._client.move_to}[verb](value)
        self._commands.append(Sent(time_s, verb, value))

    def read(self) -> None:
        time_s = self.now_s() + self._byte_s * len("H\r")
        self._positions_deg.append(self._client.position_deg())
        self._times_s.append(time_s)

    def recording(self) -> WireRecording:
        return WireRecording(tuple(self._commands), np.array(self._times_s), np.array(self._positions_deg))
