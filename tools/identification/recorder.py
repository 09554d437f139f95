"""Run the excitation on a table and poll its position meanwhile, over any port."""

from collections.abc import Callable

import numpy as np

from protocol.client import TableClient
from tools.identification.excitation import Burst
from tools.identification.lag_tracker import LagTracker, next_passage_s
from tools.identification.recording import BITS_A_BYTE, Sent, WireRecording

_STEP_DEG = 0.1
_LONGEST_WAIT_S = 0.016


def record(
    client: TableClient,
    bursts: list[Burst],
    speed_deg_s: float,
    baud: int,
    progress: Callable[[float], None] = lambda _: None,
    check: Callable[[WireRecording], None] = lambda _: None,
) -> WireRecording:
    """Return the replies of the table during the bursts; it ends at its start position.

    Args:
        client: a client that nothing else uses, with one decimal.
        bursts: from `excitation`.
        speed_deg_s: the maximum speed, which no swing reaches.
        baud: baud rate of the line: a command counts from its complete arrival at the table.
        progress: called with the finished share.
        check: called after each burst with the recording so far; it may raise to end a useless recording.

    Raises:
        TableError: the table refused a command, or did not reply. It was stopped, and a note states the result.
    """
    home_deg = round(client.position_deg(), 1)
    length_s = sum(burst.duration_s for burst in bursts)
    try:
        client.set_acceleration(max(burst.acceleration_deg_s2 for burst in bursts))  # a stop may take that long
        client.move_to(home_deg)
        client.wait_until_at(home_deg)
        recorder = _Recorder(client, baud, home_deg)
        recorder.send("S", speed_deg_s)
        recorder.read()
        for burst in bursts:
            recorder.run(burst)
            check(recorder.recording())
            progress(min(recorder.now_s() / length_s, 1.0))
        client.wait_until_at(home_deg)
    except BaseException as error:
        error.add_note(client.stop_and_report())
        raise
    return recorder.recording()


class _Recorder:
    """Records each line, its time of complete arrival at the table, and the time of its reply."""

    def __init__(self, client: TableClient, baud: int, home_deg: float) -> None:
        self._client = client
        self._home_deg = home_deg
        self._byte_s = BITS_A_BYTE / baud if baud else 0.0
        self._start_s = client.clock.now_s()
        self._lag = LagTracker()
        self._commands: list[Sent] = []
        self._times_s: list[float] = []
        self._positions_deg: list[float] = []
        self._replies_s: list[float] = []

    def now_s(self) -> float:
        return self._client.clock.now_s() - self._start_s

    def run(self, burst: Burst) -> None:
        """Send the burst's commands, and poll until it is over and the table rests."""
        self.send("A", burst.acceleration_deg_s2)
        first, *others = burst.moves
        begin_s = self.send("P", self._home_deg + first.to_deg)
        for move in others:
            self._poll(burst, begin_s, begin_s + move.send_s)
            self.send("P", self._home_deg + move.to_deg)
        self._poll(burst, begin_s, begin_s + burst.duration_s)

    def send(self, verb: str, value: float) -> float:
        """Send a command, and return the time of its complete arrival at the table."""
        value = round(value, 1)
        time_s = self.now_s() + self._line_s(f"{verb} {value:.1f}\r")
        {"S": self._client.set_speed, "A": self._client.set_acceleration, "P": self._client.move_to}[verb](value)
        self._commands.append(Sent(time_s, verb, value, self.now_s()))
        return time_s

    def read(self) -> tuple[float, float]:
        """Read the position; return it, and the time at which the command was complete at the table."""
        time_s = self.now_s() + self._line_s("H\r")
        position_deg = self._client.position_deg()
        self._times_s.append(time_s)
        self._positions_deg.append(position_deg)
        self._replies_s.append(self.now_s())
        return time_s, position_deg

    def recording(self) -> WireRecording:
        return WireRecording(
            tuple(self._commands), np.array(self._times_s), np.array(self._positions_deg), np.array(self._replies_s)
        )

    def _poll(self, burst: Burst, begin_s: float, end_s: float) -> None:
        """Read when the table is about to pass from one decimal to the next.

        Such a rounded reading contains most information.
        """

        def position_deg(time_s: float) -> float:
            reference = burst.reference(time_s - begin_s)
            return self._home_deg + reference.angle_deg - self._lag.lag_deg(reference)

        line_s = self._line_s("H\r")
        while (now_s := self.now_s()) < end_s:
            soonest_s = now_s + line_s
            wait_s = next_passage_s(position_deg, _STEP_DEG, soonest_s, _LONGEST_WAIT_S) - soonest_s
            if wait_s > 0.0:
                self._client.clock.sleep_s(wait_s)
            time_s, seen_deg = self.read()
            reference = burst.reference(time_s - begin_s)
            lag_deg = self._home_deg + reference.angle_deg - seen_deg
            self._lag.learn(reference, lag_deg - _STEP_DEG / 2.0, lag_deg + _STEP_DEG / 2.0)

    def _line_s(self, line: str) -> float:
        return self._byte_s * len(line)
