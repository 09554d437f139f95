"""A tracker between a source of locations and a table: its commands are decided as they come due."""

import time
from collections.abc import Callable
from typing import Protocol

from planner.execution.run_record import Correction
from planner.execution.stream import TimedCommand
from planner.table.wire import Wire
from planner.tracking.online_planner import Why
from planner.tracking.pose_lines import SourceError
from planner.tracking.pose_source import PoseSource
from planner.tracking.tracker import Column, Tracked, Tracker
from protocol.trapezoid import MotionCommand

# So many new columns are rated before one decision, so that a burst of locations does not make it late.
_COLUMNS_A_STEP = 4


class Observer(Protocol):
    """Observes the actions of a tracker."""

    def revealed(self, column: Column) -> None:
        """Record a column that became known."""

    def tracked(self, tracked: Tracked, seconds: float) -> None:
        """Record a decision, and the times for new columns, decision and command."""


class LiveCommands:
    """The commands of a tracker, one after the other, see `planner.execution.execute.Commands`."""

    def __init__(
        self,
        tracker: Tracker,
        source: PoseSource,
        observer: Observer,
        now_s: Callable[[], float],
        wait_s: float,
        is_real_time: bool,
    ) -> None:
        """Connect a tracker that has begun.

        Args:
            tracker: who decides.
            source: where locations come from.
            observer: observer of the actions.
            now_s: the time of the motion.
            wait_s: how long the table waits for a location before the scan ends.
            is_real_time: whether the table's time passes while nothing happens; if not, the source is waited for.
        """
        self._tracker, self._source, self._observer = tracker, source, observer
        self._now_s, self._wait_s, self._is_real_time = now_s, wait_s, is_real_time
        self._waiting_since_s: float | None = None
        self._has_failed = False

    @property
    def corrections(self) -> list[Correction]:
        """Where the reference was moved to where the encoder reads it."""
        return self._tracker.corrections

    def next(self) -> TimedCommand | None:
        """Take new locations, decide, and return the next command."""
        begin_s = time.perf_counter()
        self._take_locations()
        tracked = self._tracker.next(self._now_s())
        if tracked is None:
            return None
        self._watch_the_wait(tracked)
        self._observer.tracked(tracked, time.perf_counter() - begin_s)
        return tracked.command

    def begin_s(self, wire: Wire, latched: MotionCommand | None) -> float | None:
        """Return when to ask for the next command."""
        return self._tracker.begin_s(wire, latched)

    def latest_s(self, timed: TimedCommand) -> float:
        """Return the maximum delay of a command."""
        return self._tracker.latest_s(timed)

    def sent(self, timed: TimedCommand, late_s: float) -> None:
        """Record that a command was sent."""
        self._tracker.sent(timed, late_s)

    def encoder_read(self, time_s: float, angle_deg: float) -> None:
        """Record the position of the encoder."""
        self._tracker.encoder_read(time_s, angle_deg)

    def _take_locations(self) -> None:
        """Reveal what has come; a source that fails lets the table come to rest."""
        room = min(self._tracker.room, _COLUMNS_A_STEP)
        if not room or self._has_failed:
            return
        try:
            poses = self._source.take(room, 0.0 if self._is_real_time else self._wait_s)
        except SourceError as error:
            self._abandon(error)
            return
        for T_WS in poses:
            column = self._tracker.reveal(T_WS)
            if column is not None:
                self._observer.revealed(column)
        if self._source.has_ended:
            self._tracker.end()
        elif poses:
            self._waiting_since_s = None
        elif not self._is_real_time:
            self._abandon(self._nothing_came())

    def _watch_the_wait(self, tracked: Tracked) -> None:
        """End a scan that waits at rest, and to which no location has come for too long."""
        if tracked.step is None or tracked.step.why is not Why.NO_LOCATION:
            return
        now_s = tracked.command.time_s
        if self._waiting_since_s is None:
            self._waiting_since_s = now_s
        elif now_s - self._waiting_since_s > self._wait_s:
            self._abandon(self._nothing_came())

    def _abandon(self, error: SourceError) -> None:
        """Come to rest, and take no more locations."""
        self._has_failed = True
        self._tracker.abandon(error)

    def _nothing_came(self) -> SourceError:
        return SourceError(
            f"poses: no location came for {self._wait_s:g} s after location {self._tracker.count - 1};"
            ' send "end" after the last one'
        )


def reveal_first_view(
    tracker: Tracker, source: PoseSource, wait_s: float, progress: Callable[[int, int], None] | None = None
) -> None:
    """Give a tracker its first view, or the whole path if that is shorter.

    Raises:
        SourceError: the source sends something that is not a location, ends, or sends nothing for too long.
    """
    total = tracker.room
    while tracker.room and not source.has_ended:
        poses = source.take(tracker.room, wait_s)
        if not poses and not source.has_ended:
            raise SourceError(
                f"poses: {tracker.count} of the first {total} locations came, and then none for {wait_s:g} s;"
                ' send them, or "end" where the path is shorter'
            )
        for T_WS in poses:
            tracker.reveal(T_WS)
        if progress is not None:
            progress(tracker.count, total)
    if progress is not None:
        progress(1, 1)
    if source.has_ended:
        tracker.end()
