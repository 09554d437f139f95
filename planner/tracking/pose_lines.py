"""Scan locations as lines of JSON, one pose a line, as another program sends them; pure, in flat memory.

    [250.0, 0.0, 80.0, 0.0, 90.0, 180.0]            x y z in mm, yaw pitch roll in degrees, as in a path file
    {"location": 1, "pose": [250.0, 0.5, ...]}      the same with its number, counted from 0
    "end"                                           no more locations come

A pose may also be the sixteen numbers of a 4 x 4 matrix, or its rows.
"""

import json
from collections import deque

import numpy as np

from planner.arrays import FloatArray
from planner.cell.scan_path import numbers_of, pose_of
from planner.errors import PathError
from protocol.files.data_file import shown

END = "end"
_LONGEST_LINE = 4096
_FARTHEST_MM = 10_000.0
_ALLOWED = 'send a list of 6 or 16 numbers, {"location": N, "pose": [...]}, or "end"'


class SourceError(PathError):
    """A source of locations that sends something else, or nothing any more."""


class PoseLines:
    """The poses of a stream of bytes.

    Attributes:
        poses: (4, 4) each, parsed and not taken yet.
        has_ended: whether the end marker came.
    """

    def __init__(self, name: str) -> None:
        """Begin a stream with a name for messages."""
        self.poses: deque[FloatArray] = deque()
        self.has_ended = False
        self._name, self._rest = name, b""
        self._line, self._count = 0, 0
        self._last: FloatArray | None = None

    def feed(self, data: bytes) -> None:
        """Take bytes as they come.

        Raises:
            SourceError: a line is not a location, or repeats one, or comes after the end.
        """
        *lines, self._rest = (self._rest + data).split(b"\n")
        for line in lines:
            self._take(line)
        if len(self._rest) > _LONGEST_LINE:
            raise SourceError(f"{self._name}: line {self._line + 1} is longer than {_LONGEST_LINE} bytes; {_ALLOWED}")

    def close(self) -> None:
        """Record that the stream has ended.

        Raises:
            SourceError: the end marker is missing: the program failed, or did not send it.
        """
        if self._rest.strip():
            line, self._rest = self._rest, b""
            self._take(line)
        if not self.has_ended:
            raise SourceError(
                f'{self._name}: ended without the line "end", at {self._count} locations; send it after the last'
            )

    def _take(self, line: bytes) -> None:
        self._line += 1
        text = line.decode("utf-8", errors="replace").strip()
        where = f"{self._name}: line {self._line}"
        if not text:
            return
        if self.has_ended:
            raise SourceError(f'{where} comes after "end"; send "end" once, last')
        try:
            sent = json.loads(text)
        except (ValueError, RecursionError):
            raise SourceError(f"{where} holds {shown(text)}, which is not JSON; {_ALLOWED}") from None
        if sent == END:
            self.has_ended = True
            return
        if isinstance(sent, dict):
            sent = self._numbered(where, text, sent)
        self._add(where, text, sent)

    def _numbered(self, where: str, text: str, sent: dict[str, object]) -> object:
        if set(sent) != {"location", "pose"}:
            raise SourceError(f"{where} holds {shown(text)}; {_ALLOWED}")
        number = sent["location"]
        if not isinstance(number, int) or isinstance(number, bool) or number < 0:
            raise SourceError(f"{where} holds {shown(text)}; a location is a whole number, counted from 0")
        if number != self._count:
            what = "repeats a location" if number < self._count else "leaves locations out"
            raise SourceError(f"{where} {what}: its number is {shown(number)}; the next is {self._count}")
        return sent["pose"]

    def _add(self, where: str, text: str, sent: object) -> None:
        row = numbers_of(sent)
        if row is None:
            raise SourceError(f"{where} holds {shown(text)}; {_ALLOWED}")
        try:
            T_WS = pose_of(f"{where}:", row)
        except PathError as error:
            raise SourceError(str(error)) from None
        distance_mm = float(np.abs(T_WS[:3, 3]).max())
        if distance_mm > _FARTHEST_MM:
            raise SourceError(
                f"{where} is {distance_mm:g} mm from the workpiece; allowed are {_FARTHEST_MM:g}:"
                " are its lengths in mm?"
            )
        if self._last is not None and np.array_equal(self._last, T_WS):
            raise SourceError(f"{where} repeats the location before it; send each location once")
        self._last = T_WS
        self._count += 1
        self.poses.append(T_WS)
