"""A session with a table: run the cases one after the other, each from rest to rest."""

import logging
import traceback
from collections.abc import Callable, Iterable, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from random import Random

from protocol.bench import BenchError
from protocol.client import TableClient
from protocol.conformance.bench.host_watch import Punctual, Watch
from protocol.conformance.bench.ports import SessionError
from protocol.conformance.bench.stand import PRESET, RecordedStand, Stand, capabilities, profile_of_the_table
from protocol.conformance.bench.wire import Event, RecordedPort, Wire
from protocol.conformance.cases.case import Case
from protocol.conformance.judgement.reference import MotionRecord
from protocol.conformance.judgement.rig import Rig
from protocol.conformance.judgement.verdict import InapplicableError, Measurement, NonconformityError, Verdict
from protocol.conformance.profile.profile import Profile
from protocol.conformance.session.first_contact import CANCEL, PATIENCE_S, SETTLE_S, resting_position
from protocol.errors import TableError

_log = logging.getLogger(__name__)

__all__ = ["Outcome", "Session", "SessionError", "session_at"]

_RUNS = 5
"""How often a case is run when the testing machine was late."""
_START_DEG = 0.75
"""Tolerance of the start position of a recorded case, which may be half a degree from a whole number."""
_LONGEST_REASON = 1000
"""A longer reason is cut in the middle: a table may send anything."""


@dataclass(frozen=True)
class Outcome:
    """How a case ended. `spoiled` states for each earlier run how it failed on a machine that was late."""

    case: Case
    verdict: Verdict
    reason: str
    measurements: tuple[Measurement, ...] = ()
    motion: MotionRecord | None = None
    wire: tuple[Event, ...] = ()
    seconds: float = 0.0
    spoiled: tuple[str, ...] = ()


class Session:
    """Access of the suite to one table, from the first command until the table is back at its start position.

    Attributes:
        capabilities: the available capabilities that cases may need.
        profile: properties of the table, including those that the rig can read from it.
        home_deg: position at the start of the session. Each moving case starts there.
        is_stopped: whether standstill was observed after the last stop.
        how_it_was_left: the same as text, with the position of the table or what it will do.

    Raises:
        SessionError: the device at the port does not reply, is not a table of this protocol, or is moving.
    """

    def __init__(
        self, port: RecordedPort, profile: Profile, stand: Stand, seed: int = 0, watch: Watch | None = None
    ) -> None:
        self._port = port
        self._watch = watch or Punctual()
        self._wire = Wire(port, profile.byte_s)
        self.profile = profile = profile_of_the_table(stand, profile)
        self._stand: Stand = RecordedStand(stand, port.note)
        self._seed = seed
        self.capabilities = capabilities(stand, profile)
        self.home_deg = round(resting_position(self._wire, profile, self._watch))
        self._is_home = self.is_stopped = False
        self.how_it_was_left = "the table was not stopped"
        self._was_left = False

    def run(self, cases: Iterable[Case], report: Callable[[Outcome], None] = lambda _: None) -> list[Outcome]:
        """Run cases one after the other, and return the table to its home position.

        An interrupt such as Ctrl-C stops the table.

        After such a stop, the table stays where it is.
        """
        outcomes = []
        try:
            for one in cases:
                outcomes.append(self.run_case(one))
                report(outcomes[-1])
            self.end()
        except BaseException:
            self._leave()
            raise
        return outcomes

    def run_case(self, case: Case) -> Outcome:
        """Run one case and leave the table at rest. If this machine was late, a failed case is run again.

        An interrupt stops the table, as in `run`.
        """
        _log.debug("case %s", case.id)
        lacking = self._lacking(case)
        if lacking:
            return Outcome(case, Verdict.SKIPPED, lacking)
        try:
            return self._run_in_time(case)
        except BaseException:
            self._leave()
            raise

    def _run_in_time(self, case: Case) -> Outcome:
        allowed_s = self.profile.serial.latency_s
        spoiled: list[str] = []
        while True:
            self._watch.restart()
            outcome = self._run_once(case)
            late_s = self._watch.late_s()
            if outcome.verdict is not Verdict.FAIL or late_s <= allowed_s:
                return replace(outcome, spoiled=tuple(spoiled))
            spoiled.append(f"this machine was {late_s:.2g} s late: {outcome.reason}")
            if len(spoiled) == _RUNS:
                return replace(outcome, verdict=Verdict.ERROR, reason=spoiled.pop(), spoiled=tuple(spoiled))
            self._watch.wait_for_calm(allowed_s, PATIENCE_S)
            self._recover(case)

    def _run_once(self, case: Case) -> Outcome:
        first_event, begin_s = len(self._port.events), self._port.clock.now_s()
        rig = self._rig(case.id)
        verdict, reason = self._judged(case, rig)
        self._is_home = self._is_home and verdict is not Verdict.ERROR
        seconds = self._port.clock.now_s() - begin_s
        motion = rig.motion if rig.motion.samples else None
        events = tuple(self._port.events[first_event:])
        return Outcome(case, verdict, reason, tuple(rig.measurements), motion, events, seconds)

    def stop(self) -> None:
        """Stop the table where it is, whatever the line contains, if it still replies."""
        serial, motion = self.profile.serial, self.profile.motion
        self._is_home = self.is_stopped = False
        try:
            client = TableClient(self._port, serial.timeout_s, serial.decimals, motion.acceleration_deg_s2)
            self.how_it_was_left = f"the table was stopped and stands at {client.stop():.6g} deg"
            self.is_stopped = True
        except TableError as error:
            self.how_it_was_left = str(error)
        with suppress(OSError):
            self._wire.drain(SETTLE_S + serial.latency_s, PATIENCE_S)

    def begin_replay(self, case: str, start_deg: float) -> None:
        """Set S and A to the profile's maximum before a recorded case, and check the start position of the table.

        Raises:
            SessionError: the table is at another position, or it gives a wrong reply.
        """
        rig = self._rig("replay")
        self._wire.send(CANCEL)
        self._wire.drain(SETTLE_S + self.profile.serial.latency_s, PATIENCE_S)
        try:
            rig.full_settings()
            position_deg = float(rig.wait_for_rest())
        except NonconformityError as error:
            raise SessionError(f"before case {case}: {error}") from error
        if abs(position_deg - start_deg) > _START_DEG:
            raise SessionError(
                f"before case {case} the table is at {position_deg:g} deg and should be at {start_deg:g}:"
                " it executed a command that it must refuse"
            )

    def end(self) -> None:
        """Stop the table, and return it to the start position of the session, unless an interrupt ended the session."""
        if self._was_left:
            return
        self.stop()
        with suppress(NonconformityError, OSError):
            self._go_home()

    def _leave(self) -> None:
        if not self._was_left:
            self._was_left = True
            self.stop()

    def _go_home(self) -> None:
        self._rig("home").go_home()
        self._is_home = True

    def _rig(self, purpose: str) -> Rig:
        chance = Random(f"{self._seed} {purpose}")  # noqa: S311  # not for security
        return Rig(self._wire, self.profile, self._stand, self.home_deg, chance, self._watch)

    def _judged(self, case: Case, rig: Rig) -> tuple[Verdict, str]:
        """Return verdict and reason of a case. After a failure, the table is stopped and its line is empty."""
        try:
            if case.travel_deg:
                if not self._is_home:
                    self._go_home()
                rig.full_settings()
                rig.stand_at_home()
            case.run(rig)
            rig.silence("after the last reply the line")
            self._restore(case, rig)
        except InapplicableError as error:
            return Verdict.SKIPPED, str(error)
        except NonconformityError as error:
            self._after_failure(case, rig)
            return Verdict.FAIL, _shortened(str(error))
        except BenchError as error:
            self._after_failure(case, rig)
            return Verdict.ERROR, str(error)
        except OSError as error:
            return Verdict.ERROR, f"{type(error).__name__}: {error}"
        except Exception as error:  # an exception in a case ends only this case
            self._after_failure(case, rig)
            return Verdict.ERROR, "".join(traceback.format_exception_only(error)).strip()
        return _verdict_on(rig.measurements)

    def _lacking(self, case: Case) -> str:
        """Return why a case cannot be run, or an empty text."""
        waived = self.profile.waive.get(case.clause.number)
        if waived is not None:
            return f"waived by the profile: {waived}"
        lacking = sorted(case.needs - self.capabilities)
        if lacking:
            return f"{' and '.join(lacking)} not available"
        if case.travel_deg > self.profile.motion.reach_deg:
            return f"turns by {case.travel_deg:g} deg; the profile allows {self.profile.motion.reach_deg:g}"
        return ""

    def _restore(self, case: Case, rig: Rig) -> None:
        """Leave the table at home for the next case. If a case moved the counter's zero, home has another angle."""
        if PRESET in case.needs:
            self._stand.power_cycle()  # the table is where it was
            self.home_deg = 0
            return
        self.home_deg = rig.home_deg
        if case.travel_deg:
            rig.go_home()

    def _after_failure(self, case: Case, rig: Rig) -> None:
        self.home_deg = rig.home_deg
        self._recover(case)

    def _recover(self, case: Case) -> None:
        """Stop the table, empty the line, and return the table to its home position."""
        if PRESET in case.needs:
            try:
                self._stand.power_cycle()
            except BenchError:
                return
            self.home_deg = 0
        self.end()


def _shortened(reason: str) -> str:
    half = _LONGEST_REASON // 2
    return reason if len(reason) <= _LONGEST_REASON else f"{reason[:half]} ... {reason[-half:]}"


def _verdict_on(measurements: Sequence[Measurement]) -> tuple[Verdict, str]:
    for worst in (Verdict.FAIL, Verdict.MARGINAL):
        found = [str(measurement) for measurement in measurements if measurement.verdict is worst]
        if found:
            return worst, "; ".join(found)
    return Verdict.PASS, ""


def session_at(
    url: str, port: RecordedPort, profile: Profile, stand: Stand, seed: int = 0, watch: Watch | None = None
) -> Session:
    """Start a session. Messages about the table start with the name of its port.

    Raises:
        SessionError: see `Session`; or the port fails.
    """
    try:
        return Session(port, profile, stand, seed, watch)
    except SessionError as error:
        raise SessionError(f"{url}: {error}") from error
    except OSError as error:
        raise SessionError(f"{url}: the port failed: {error}; check the table and its connection") from error
