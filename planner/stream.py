"""From a planned motion to timed commands: one `A`, `S`, `P` for each step, no I/O.

The wire carries one decimal. Rounding each value on its own would let the errors add up, so each step starts from where
the reference is *predicted* to be, exactly, after all commands before it (`velocity_profile`), and takes the S and A
that bring it nearest to the plan at the step's end: what one step could not say, the next one takes out.

In a step the reference goes from its present speed towards S at the rate A, and then holds S. P only gives the
direction, but the controller brakes for it, so it lies beyond the way to stop. It does not lie farther than that: if
the line dies, the table runs on to P and stands there.
"""

import math
from collections.abc import Iterable, Iterator, Sequence
from decimal import Decimal
from itertools import pairwise
from typing import NamedTuple

from planner.errors import PlannerError
from planner.motion import Limits
from planner.table_motion import Leg, TableMotion
from planner.velocity_profile import MotionCommand, ReferenceState, advance, move
from protocol import Command, Ok, Verb, encode_command, encode_reply

# A speed below this counts as standing: it is what additions leave of zero.
_STANDING_DEG_S = 1e-6
# A command may come this late before the table starts to brake for the target of the one before.
LATEST_S = 0.1

# What a deg of error at the end of a step is weighed against: half as much in its middle; the way that an error of the
# end's speed makes in a third of a step; and, in the smallest number a degree, the way that the table runs on when the
# line dies, so that of equals the one is taken which stops soonest.
_MIDDLE_WEIGHT = 0.5
_SPEED_WEIGHT = 0.3
_RUN_ON_WEIGHT = 1e-4
_SHORT_RUN_ON_DEG = 90.0


class StreamError(PlannerError):
    """A motion that cannot be said to the table as commands."""


class Wire(NamedTuple):
    """What the commands have to pass.

    Attributes:
        decimals: places after the point.
        baud: 10 bits a byte; 0 where bytes take no time.
        turnaround_s: from the end of a command to the start of the next beyond the time of the bytes: what driver,
            adapter and operating system take.
        latency_s: from the arrival of a CR to its effect: a tick of the firmware, and clocks that tell whole ticks.
    """

    decimals: int = 1
    baud: int = 9600
    turnaround_s: float = 0.002
    latency_s: float = 0.0015

    @property
    def quantum(self) -> float:
        """The smallest difference of two numbers."""
        return float(10.0**-self.decimals)

    def seconds(self, byte_count: int) -> float:
        """Return how long bytes take."""
        return 10.0 * byte_count / self.baud if self.baud else 0.0


class TimedCommand(NamedTuple):
    """A motion command and the moment at which it takes effect: when the CR of its P has arrived.

    Attributes:
        time_s: in the time of the motion, 0 at the first scan location.
        leg: what it is for.
        command: target, S and A, as the wire carries them.
        expected: where the reference is at that moment.
    """

    time_s: float
    leg: Leg
    command: MotionCommand
    expected: ReferenceState


def stream(
    motion: TableMotion, limits: Limits, wire: Wire, first: int = 0, start: ReferenceState | None = None
) -> tuple[TimedCommand, ...]:
    """Return the commands of a motion, in the order of their times.

    Args:
        motion: what the table should do.
        limits: greatest S and A.
        wire: how fine the numbers are.
        first: the first leg to command; those before are done.
        start: where the reference is at its beginning; None: at rest at the motion's start, as far as the wire can say
            that.

    Raises:
        StreamError: a limit is below the smallest number that the wire can say.
    """
    grid = _Grid(limits, wire)
    state = start or ReferenceState(grid.nearest(motion.start_deg), 0.0)
    commands = []
    for leg in motion.legs[first:]:
        command = _on_the_wire(leg.command, grid) if leg.command else _closest(state, leg, grid)
        commands.append(TimedCommand(leg.start_s, leg, command, state))
        state = advance(state, command, leg.duration_s)
    return tuple(commands)


def rounded_stream(motion: TableMotion, limits: Limits, wire: Wire) -> tuple[TimedCommand, ...]:
    """Return the commands with S and A of each step rounded on its own: what `stream` is to be compared with."""
    grid = _Grid(limits, wire)
    state = ReferenceState(grid.nearest(motion.start_deg), 0.0)
    commands = []
    for leg in motion.legs:
        if leg.command is not None:
            command = _on_the_wire(leg.command, grid)
        else:
            end_speed = leg.state_at(leg.end_s).speed_deg_s
            heading = end_speed if abs(end_speed) > _STANDING_DEG_S else leg.acceleration_deg_s2
            speed = math.copysign(grid.speed(abs(end_speed)), heading)
            command = _towards(state, speed, grid.rate(abs(leg.acceleration_deg_s2)), leg.duration_s, grid)
        commands.append(TimedCommand(leg.start_s, leg, command, state))
        state = advance(state, command, leg.duration_s)
    return tuple(commands)


def check_it_fits(commands: Sequence[TimedCommand], wire: Wire) -> None:
    """Refuse commands that follow one another faster than the wire carries them.

    Raises:
        StreamError: with the step that would fit.
    """
    for before, following in pairwise(commands):
        needed_s = exchanges_s(wire, following.command, before.command)
        step_s = following.time_s - before.time_s
        if needed_s > step_s:
            most_s = max(exchanges_s(wire, two.command, one.command) for one, two in pairwise(commands))
            raise StreamError(
                f"the commands of location {following.leg.column} take {1000 * needed_s:.0f} ms at {wire.baud} baud,"
                f" and the step before lasts {1000 * step_s:.0f} ms; a time step of {math.ceil(100 * most_s) / 100:g} s"
                " would fit"
            )


def exchanges_s(wire: Wire, command: MotionCommand, before: MotionCommand | None = None) -> float:
    """Return how long the commands of one step take with their replies, and the reading of the latch.

    An S or an A that is the same as `before` is not sent again.
    """
    lines = [encode_command(Command(Verb.READ_LATCH)), command_line(Verb.MOVE_TO, command.target_deg, wire)]
    if before is None or command.speed_deg_s != before.speed_deg_s:
        lines.append(command_line(Verb.SET_SPEED, command.speed_deg_s, wire))
    if before is None or command.acceleration_deg_s2 != before.acceleration_deg_s2:
        lines.append(command_line(Verb.SET_ACCELERATION, command.acceleration_deg_s2, wire))
    # The latch is answered with an angle about as long as P's own line, the others with OK.
    replies = len(lines[1]) + (len(lines) - 1) * len(encode_reply(Ok()))
    return wire.seconds(sum(map(len, lines)) + replies) + wire.turnaround_s * len(lines)


def command_line(verb: Verb, value: float, wire: Wire) -> bytes:
    """Return a command as the wire carries it."""
    return encode_command(Command(verb, Decimal(repr(value))), wire.decimals)


def reference_states(commands: Iterable[TimedCommand], times_s: Iterable[float]) -> Iterator[ReferenceState]:
    """Yield where the reference is at ascending times, by the controller's own rules."""
    following = iter(commands)
    current, after = next(following), next(following, None)
    for time_s in times_s:
        while after is not None and after.time_s <= time_s:
            current, after = after, next(following, None)
        yield advance(current.expected, current.command, max(0.0, time_s - current.time_s))


class _Grid:
    """The numbers that the wire can say, within the limits."""

    def __init__(self, limits: Limits, wire: Wire) -> None:
        self.quantum = wire.quantum
        self._decimals = wire.decimals
        self._most_speed = self._whole(limits.speed_deg_s)
        self._most_rate = self._whole(limits.acceleration_deg_s2)
        if not (self._most_speed and self._most_rate):
            raise StreamError(
                f"the table's limits are {limits.speed_deg_s:g} deg/s and {limits.acceleration_deg_s2:g} deg/s2;"
                f" with {wire.decimals} decimals both must be at least {self.quantum:g}"
            )

    def nearest(self, value: float) -> float:
        """Return the number nearest to a value."""
        return self._number(round(value / self.quantum))

    def speed(self, value: float) -> float:
        """Return the allowed S nearest to a speed."""
        return self._number(min(max(round(value / self.quantum), 1), self._most_speed))

    def rate(self, value: float) -> float:
        """Return the allowed A nearest to a rate."""
        return self._number(min(max(round(value / self.quantum), 1), self._most_rate))

    def rates_around(self, value: float) -> tuple[float, float]:
        """Return the allowed A next below and above a rate."""
        below = math.floor(min(value / self.quantum, self._most_rate))
        return self.rate(below * self.quantum), self.rate((below + 1) * self.quantum)

    def speeds_around(self, speed_deg_s: float, count: int) -> list[float]:
        """Return the allowed speeds, signed and without 0, within `count` numbers of one."""
        middle = round(speed_deg_s / self.quantum)
        most = self._most_speed
        return [self._number(n) for n in range(middle - count, middle + count + 1) if n and -most <= n <= most]

    def beyond(self, angle_deg: float, forward: float) -> float:
        """Return the nearest number that is beyond an angle, in the direction `forward` (1 or -1)."""
        return self._number(int(forward * (math.floor(forward * angle_deg / self.quantum + 1e-6) + 1)))

    def _whole(self, limit: float) -> int:
        return math.floor(limit / self.quantum + 1e-6)

    def _number(self, n: int) -> float:
        return round(n * self.quantum, self._decimals)


def _on_the_wire(command: MotionCommand, grid: _Grid) -> MotionCommand:
    target, speed, rate = command
    return MotionCommand(grid.nearest(target), grid.speed(speed), grid.rate(rate))


def _closest(state: ReferenceState, leg: Leg, grid: _Grid) -> MotionCommand:
    """Return the command that brings the reference nearest to the plan by the end of a leg."""
    middle, end = (leg.state_at(leg.start_s + share * leg.duration_s) for share in (0.5, 1.0))
    chosen, least = None, math.inf
    for speed, rate in _candidates(state, end, leg.duration_s, grid):
        there = _ramp(state, speed, rate, leg.duration_s)
        error = _error(_ramp(state, speed, rate, 0.5 * leg.duration_s), there, middle, end, leg.duration_s)
        error += (_RUN_ON_WEIGHT * grid.quantum * 0.5 * there.speed_deg_s**2 / rate) ** 2
        if error < least:
            chosen, least = (speed, rate), error
    assert chosen is not None
    command = _towards(state, *chosen, leg.duration_s, grid)
    if abs(end.speed_deg_s) > _STANDING_DEG_S:
        return command
    for stop in _stops(state, end, leg.duration_s, grid):
        half, full = (advance(state, stop, share * leg.duration_s) for share in (0.5, 1.0))
        error = _error(half, full, middle, end, leg.duration_s)
        if error < least:
            command, least = stop, error
    return command


def _candidates(
    state: ReferenceState, end: ReferenceState, duration_s: float, grid: _Grid
) -> Iterator[tuple[float, float]]:
    """Yield signed S, and A, around those that would meet the end of a step if any number could be said.

    Either the ramp is over before the step is: then the way, S T - (S - v)^2 / 2A, says A. Or it is not: then the way
    is v T + A T^2 / 2. Or A is simply that of the plan, or one that soon stops a table whose line died.
    """
    way = end.angle_deg - state.angle_deg
    speed = state.speed_deg_s
    unfinished = 2.0 * abs(way - speed * duration_s) / duration_s**2
    planned = abs(end.speed_deg_s - speed) / duration_s
    for top in grid.speeds_around(end.speed_deg_s, 4):
        lag = abs(top * duration_s - way)
        finished = 0.5 * (top - speed) ** 2 / lag if lag > 0.0 else math.inf
        for rate in (finished, unfinished, planned, 0.5 * top**2 / _SHORT_RUN_ON_DEG):
            for number in grid.rates_around(rate):
                yield top, number


def _stops(state: ReferenceState, end: ReferenceState, duration_s: float, grid: _Grid) -> Iterator[MotionCommand]:
    """Yield commands that bring the reference to rest, near the end of a step that ends at rest."""
    way = abs(end.angle_deg - state.angle_deg)
    mean = abs(state.speed_deg_s) / duration_s
    braking = 0.5 * state.speed_deg_s**2 / way if way > 0.0 else mean
    for target in (grid.nearest(end.angle_deg + shift * grid.quantum) for shift in (-1, 0, 1)):
        for speed in (grid.speed(abs(state.speed_deg_s)), grid.speed(abs(state.speed_deg_s) + grid.quantum)):
            for rate in (*grid.rates_around(braking), *grid.rates_around(1.2 * braking), grid.rate(10.0 * braking)):
                yield MotionCommand(target, speed, rate)


def _error(
    middle: ReferenceState,
    end: ReferenceState,
    planned_middle: ReferenceState,
    planned_end: ReferenceState,
    duration_s: float,
) -> float:
    """Return the squared error of a step, in deg^2."""
    return (
        (end.angle_deg - planned_end.angle_deg) ** 2
        + (_MIDDLE_WEIGHT * (middle.angle_deg - planned_middle.angle_deg)) ** 2
        + (_SPEED_WEIGHT * duration_s * (end.speed_deg_s - planned_end.speed_deg_s)) ** 2
    )


def _ramp(state: ReferenceState, speed_deg_s: float, rate_deg_s2: float, duration_s: float) -> ReferenceState:
    """Return where the reference gets that goes to a signed speed at a rate, and holds it; its target is far away."""
    change = speed_deg_s - state.speed_deg_s
    ramp_s = abs(change) / rate_deg_s2
    acceleration = math.copysign(rate_deg_s2, change)
    if duration_s <= ramp_s:
        return move(state, acceleration, duration_s)
    reached = move(state, acceleration, ramp_s)
    return ReferenceState(reached.angle_deg + speed_deg_s * (duration_s - ramp_s), speed_deg_s)


def _towards(
    state: ReferenceState, speed_deg_s: float, rate_deg_s2: float, duration_s: float, grid: _Grid
) -> MotionCommand:
    """Return the command of a signed speed, with the nearest target for which the table does not brake too soon."""
    forward = math.copysign(1.0, speed_deg_s)
    late = _ramp(state, speed_deg_s, rate_deg_s2, duration_s + LATEST_S)
    farthest = forward * state.angle_deg
    if forward * late.speed_deg_s > 0.0:
        farthest = max(farthest, forward * late.angle_deg + 0.5 * late.speed_deg_s**2 / rate_deg_s2)
    return MotionCommand(grid.beyond(forward * farthest, forward), abs(speed_deg_s), rate_deg_s2)
