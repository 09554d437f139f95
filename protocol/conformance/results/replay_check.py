"""Decode recorded traffic and check its effect on this table, before any of it is sent.

A record may come from anyone, so it is not trusted. Its lines are followed as this table would execute them, with its
own limits and from its own position. Where several courses are possible, all of them must be allowed: a table with a
wider grammar may execute a line that it must refuse, a command may be late, bytes may be lost.
"""

from collections.abc import Iterator, Sequence
from typing import NamedTuple

from protocol.conformance.judgement.possible_commands import certain_command, glued, possible_commands
from protocol.conformance.profile.profile import Profile
from protocol.conformance.results.record import RecordedCase
from protocol.conformance.results.recorded_lines import BEGIN, Line, crowded_lines, recorded_lines
from protocol.messages import Command, Verb
from protocol.trapezoid import Motion, MotionCommand, ReferenceState

_DELAYS = ((0.0,), (1.0,), (0.0, 1.0), (1.0, 0.0))
"""Delays of the commands in turn, as a share of the delay that adapter and scheduler may add."""
_LATE_S = 0.005
_MOST_COURSES = 500
_MOST_PLACES = 9
_MOST_CROWDED = 40
_SLACK_DEG = 1e-6
_NOTHING_KNOWN = "leaves the motion of the table undetermined"


class Misfit(NamedTuple):
    """A line that must not be sent to this table, and the reason."""

    case: str
    line: bytes
    reason: str

    def __str__(self) -> str:
        return f"{self.line!r} of case {self.case} {self.reason}"


def check(cases: Sequence[RecordedCase], home_deg: float, profile: Profile) -> Misfit | list[float]:
    """Return the first line that may move this table farther, faster or with more acceleration than its profile allows.

    If there is none, return the position of the table at the start of each case.

    Args:
        cases: the cases to send, in this order.
        home_deg: present position of the table.
        profile: profile of this table.
    """
    for case in cases:
        if found := _glued_misfit(case, home_deg, profile):
            return found
    lines = list(recorded_lines(cases, profile))
    walks = [_Walk(home_deg, profile, delays) for delays in _DELAYS]
    for walk in walks:
        if found := walk.take(lines):
            return found
    return walks[0].starts_deg


class _Course(NamedTuple):
    """A possible motion of the table. Its angles count from the first position of the table."""

    motion: Motion
    began_s: float

    def at(self, time_s: float) -> ReferenceState:
        """Return position and speed, rounded so that courses merge when they rest at the same place."""
        position, speed = self.motion.at(time_s - self.began_s)
        return ReferenceState(round(position, 6), round(speed, 6))


class _Walk:
    """The possible courses of a table that receives the lines.

    Attributes:
        starts_deg: position of the table at the start of each case.
    """

    def __init__(self, home_deg: float, profile: Profile, delays: Sequence[float]) -> None:
        """Start at rest; `delays` are the delays of the lines, in turn."""
        self._profile, self._delays = profile, delays
        self._late_s = profile.serial.latency_s + _LATE_S
        self._zero_deg = -home_deg  # value of the register at the first position of the table
        self._lawful = _resting(0.0, 0.0)  # the course of a table that refuses what it must refuse
        self._courses = {self._lawful}
        self._set(profile.motion.speed_deg_s, profile.motion.acceleration_deg_s2)
        self.starts_deg: list[float] = []

    def take(self, lines: Sequence[Line]) -> Misfit | None:
        """Follow the lines, and return the first one that violates the profile."""
        for index, line in enumerate(lines):
            late_s = self._late_s * self._delays[index % len(self._delays)]
            reason = self._deed(line) if line.deed else self._line(line._replace(time_s=line.time_s + late_s))
            if reason:
                return Misfit(line.case, line.text or line.deed.encode(), reason)
        return None

    def _begin_case(self, time_s: float) -> None:
        """Start at rest: before each case, the replay checks the position of the table, and sets S and A."""
        position = self._lawful.motion.target_deg
        self.starts_deg.append(position - self._zero_deg)
        self._lawful = _resting(position, time_s)
        self._courses = {self._lawful}
        self._set(self._profile.motion.speed_deg_s, self._profile.motion.acceleration_deg_s2)

    def _set(self, top_deg_s: float, rate_deg_s2: float) -> None:
        self._top, self._rate = top_deg_s, rate_deg_s2
        self._tops, self._rates = {top_deg_s}, {rate_deg_s2}  # including the settings from lines that must be refused

    def _line(self, line: Line) -> str:
        """Follow a line, and return its violation, or an empty text."""
        command = certain_command(line.text) if line.is_whole else None
        if command is not None and not self._must_refuse(command):
            return self._certain(command, line.time_s)
        readings = [command] if command is not None else possible_commands(line.text)
        return next((reason for each in readings if (reason := self._possible(each, line.time_s))), "")

    def _certain(self, command: Command, time_s: float) -> str:
        """Follow a command that every table of this protocol executes."""
        if command.value is None:
            return ""
        value, allowed = float(command.value), self._profile.motion
        if command.verb is Verb.SET_SPEED:
            self._top, self._tops = value, {value}
            return _beyond(value, allowed.speed_deg_s, "sets {:g} deg/s")
        if command.verb is Verb.SET_ACCELERATION:
            self._rate, self._rates = value, {value}
            return _beyond(value, allowed.acceleration_deg_s2, "sets {:g} deg/s2")
        self._lawful = self._moved(command, time_s, self._lawful.at(time_s), self._top, self._rate)
        self._courses = self._all_moved(command, time_s)
        return self._wrong()

    def _possible(self, command: Command, time_s: float) -> str:
        """Follow a command that this table must refuse but another may execute."""
        value = float(command.value or 0)
        if command.verb is Verb.SET_SPEED:
            self._tops |= {value} if value > 0.0 else set()
        elif command.verb is Verb.SET_ACCELERATION:
            self._rates |= {value} if value > 0.0 else set()
        elif not self._leaves_the_counter(command):
            standing = {_resting(position, time_s) for position, speed in self._states(time_s) if not speed}
            moving = {course for course in self._courses if course.at(time_s)[1]}
            self._courses = standing | moving | self._all_moved(command, time_s)
            return self._wrong()
        return ""

    def _all_moved(self, command: Command, time_s: float) -> set[_Course]:
        states = self._states(time_s)
        if len(states) * len(self._tops) * len(self._rates) > _MOST_COURSES:
            return {self._lawful} | {_resting(index, time_s) for index in range(_MOST_COURSES + 1)}
        return {
            self._moved(command, time_s, state, top, rate)
            for state in states
            for top in self._tops
            for rate in self._rates
        }

    def _moved(
        self, command: Command, time_s: float, state: ReferenceState, top_deg_s: float, rate_deg_s2: float
    ) -> _Course:
        position, speed = state
        target = float(command.value or 0) + (self._zero_deg if command.verb is Verb.MOVE_TO else position)
        if not speed and abs(target - position) < _SLACK_DEG:
            return _resting(position, time_s)
        return _Course(Motion.of(state, MotionCommand(target, top_deg_s, rate_deg_s2)), time_s)

    def _states(self, time_s: float) -> list[ReferenceState]:
        """Return the possible positions and speeds of the table. Of many rest positions, only some are returned."""
        states = {course.at(time_s) for course in self._courses}
        resting = sorted(state for state in states if not state[1])
        if len(resting) > _MOST_PLACES:  # the first and the last of them
            share = (len(resting) - 1) / (_MOST_PLACES - 1)
            resting = [resting[round(index * share)] for index in range(_MOST_PLACES)]
        return [*resting, *(state for state in states if state[1])]

    def _wrong(self) -> str:
        """Return the violation by the motions that are possible now, or an empty text."""
        allowed = self._profile.motion
        if len(self._courses) > _MOST_COURSES:
            return _NOTHING_KNOWN
        if not any(course.motion.segments for course in self._courses):
            return ""
        farthest_deg = max(abs(angle) for course in self._courses for angle in _turning_points(course.motion))
        return (
            _beyond(max(self._tops), allowed.speed_deg_s, "may move the table at {:g} deg/s")
            or _beyond(max(self._rates), allowed.acceleration_deg_s2, "may move the table at {:g} deg/s2")
            or _beyond(farthest_deg, allowed.reach_deg, "may take the table {:.6g} deg from where it stands")
        )

    def _must_refuse(self, command: Command) -> bool:
        value, limits = float(command.value or 0), self._profile.limits
        if command.verb is Verb.SET_SPEED:
            return not 0.0 < value <= limits.speed_deg_s
        if command.verb is Verb.SET_ACCELERATION:
            return not 0.0 < value <= limits.acceleration_deg_s2
        return self._leaves_the_counter(command)

    def _leaves_the_counter(self, command: Command) -> bool:
        """Return whether a counter like this table's cannot hold the target, or half of the travel (4.4/2, 4.4/3)."""
        if command.verb not in {Verb.MOVE_TO, Verb.MOVE_BY}:
            return False
        value, range_deg = float(command.value or 0), self._profile.range_deg
        angles = {angle - self._zero_deg for course in self._courses for angle in _turning_points(course.motion)}
        ways = [abs(value - angle) for angle in angles] if command.verb is Verb.MOVE_TO else [abs(value)]
        return abs(value) > range_deg or min(ways) > range_deg

    def _deed(self, line: Line) -> str:
        """Follow the start of a case, or an action of the rig: the table is switched off and on.

        Then the table reports another angle at the same place.
        """
        if line.deed == BEGIN:
            self._begin_case(line.time_s)
            return ""
        word, _, count = line.deed.partition(" ")
        if word not in {"power_cycle", "preset"}:
            return ""
        states = self._states(line.time_s)
        if any(speed for _, speed in states):
            return "switches the table off while it may move"
        if len(states) > 1:
            return _NOTHING_KNOWN
        position = states[0][0]
        self._zero_deg = position - int(count or 0) / self._profile.table.counts_per_deg
        self._lawful = _resting(position, line.time_s)
        self._courses = {self._lawful}
        self._set(self._profile.power_on.speed_deg_s, self._profile.power_on.acceleration_deg_s2)
        return ""


def _glued_misfit(case: RecordedCase, home_deg: float, profile: Profile) -> Misfit | None:
    """Return a line that may result from lost bytes and must not be executed from any position."""
    allowed = profile.motion
    for lines in crowded_lines(case, profile):
        if len(lines) > _MOST_CROWDED:
            return Misfit(case.id, lines[-1], f"and others are sent without waiting for replies; this {_NOTHING_KNOWN}")
        for line in glued(lines):
            for command in possible_commands(line):
                value = abs(float(command.value or 0) - (home_deg if command.verb is Verb.MOVE_TO else 0.0))
                most = {Verb.SET_SPEED: allowed.speed_deg_s, Verb.SET_ACCELERATION: allowed.acceleration_deg_s2}
                if value > most.get(command.verb, allowed.reach_deg):
                    return Misfit(case.id, line, "may result from lost bytes, and violates the profile")
    return None


def _turning_points(motion: Motion) -> Iterator[float]:
    """Yield the angles at the ends of a motion's phases: the motion does not pass them."""
    time_s = 0.0
    yield motion.start.angle_deg
    for segment in motion.segments:
        time_s += segment.duration_s
        yield motion.at(time_s)[0]
    yield motion.target_deg


def _beyond(value: float, most: float, sentence: str) -> str:
    return f"{sentence.format(value)}; the profile allows {most:g}" if value > most + _SLACK_DEG else ""


def _resting(angle_deg: float, since_s: float) -> _Course:
    return _Course(Motion.at_rest(angle_deg), since_s)
