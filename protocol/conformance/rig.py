"""What a case holds in its hands: the table's wire, its motion beside the motion that it should make, and a pencil."""

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from decimal import Decimal
from random import Random
from typing import NamedTuple

from protocol.conformance.profile import Profile
from protocol.conformance.stand import Stand
from protocol.conformance.trapezoid import Motion, plan
from protocol.conformance.verdict import Measurement, NonconformityError
from protocol.conformance.wire import CR, Line, Wire
from protocol.messages import ErrorCode

QUIET_S = 0.05
"""What must stay silent is listened to for this long, and the latency."""

_POLL_S = 0.005
_REST_READINGS = 5
_DELAYS = ((0.0,), (-1.0,), (1.0,), (-1.0, 1.0), (1.0, -1.0))
"""When commands were carried out, within the times that they leave open: the courses that a motion may have taken."""
_REST_INTERVAL_S = 0.05
_REST_TIMEOUT_S = 30.0
_ANGLE = re.compile(rb"([HL]) (-?(?:0|[1-9][0-9]*)\.([0-9]+))")


class Sample(NamedTuple):
    """A position that the table reported: the middle and the half width of the time in which it was so."""

    time_s: float
    position_deg: float
    uncertainty_s: float


class Expectation(NamedTuple):
    """A commanded motion, and the time at which it began."""

    began_s: float
    motion: Motion

    def at(self, time_s: float) -> tuple[float, float]:
        """Return where the reference should be, and at what speed."""
        return self.motion.at(time_s - self.began_s)


@dataclass
class MotionRecord:
    """What was expected and what was seen of a table in motion."""

    expectations: list[Expectation] = field(default_factory=list)
    samples: list[Sample] = field(default_factory=list)


class Rig:
    """One case's access to the table.

    Attributes:
        home_deg: where the session began, and where each moving case begins.
        measurements: what was measured.
        motion: what was seen and expected of the table's motion.
        chance: the seeded source of what a case leaves to chance.
    """

    def __init__(self, wire: Wire, profile: Profile, stand: Stand, home_deg: int, chance: Random) -> None:
        self.wire = wire
        self.profile = profile
        self.stand = stand
        self.home_deg = home_deg
        self.chance = chance
        self.measurements: list[Measurement] = []
        self.motion = MotionRecord()
        self.top_deg_s = self.rate_deg_s2 = 0.0
        self._courses: list[list[Expectation]] = []

    # What is said on the wire

    def ask(self, line: bytes) -> Line:
        """Send a line and return its reply.

        Raises:
            NonconformityError: none came in time.
        """
        self.wire.send(line + CR)
        return self.reply_to(line)

    def reply_to(self, line: bytes) -> Line:
        """Return the next reply, which is that to `line`."""
        reply = self.wire.read_line(self.profile.serial.timeout_s)
        if reply is None:
            raise NonconformityError(f"{line!r} got no reply within {self.profile.serial.timeout_s:g} s")
        return reply

    def expect(self, line: bytes, reply: bytes = b"OK") -> Line:
        """Send a line and require its very reply."""
        got = self.ask(line)
        require(got.text == reply, f"{line!r} got {got.text!r}, not {reply!r}")
        return got

    def refused(self, line: bytes, code: ErrorCode) -> None:
        """Send a line and require its refusal: by its number, or by silence where there are no error replies."""
        self.wire.send(line + CR)
        self.expect_refusal(line, code)

    def expect_refusal(self, line: bytes, code: ErrorCode) -> None:
        """Require the refusal of a line that was sent."""
        if not self.profile.serial.error_replies:
            self.silence(f"refused {line!r}")
            return
        got = self.reply_to(line)
        begins = b"ERR %d " % code
        require(got.text.startswith(begins), f"{line!r} got {got.text!r}, not {begins.decode()}{code.text}")

    def silence(self, why: str) -> None:
        """Require that nothing comes."""
        heard = self.wire.listen(QUIET_S + self.profile.serial.latency_s)
        require(not heard, f"{why} got {heard!r}, not silence")

    def read(self, letter: bytes = b"H") -> Decimal:
        """Read a register in exactly the form that clause 5.2 gives it."""
        return self.angle_in(self.ask(letter), letter)

    def angle_in(self, reply: Line, letter: bytes = b"H") -> Decimal:
        """Return the angle that a reply says, or raise NonconformityError."""
        found = _ANGLE.fullmatch(reply.text)
        decimals = self.profile.serial.decimals
        if found is None or found[1] != letter or len(found[3]) != decimals:
            raise NonconformityError(
                f"{letter!r} got {reply.text!r}, not {letter.decode()} and an angle with {decimals} decimals"
            )
        angle = Decimal(found[2].decode())
        require(angle != 0 or not found[2].startswith(b"-"), f"{letter!r} got {reply.text!r}: zero has no sign")
        return angle

    def measure(
        self, name: str, value: float, unit: str, least: float | None = None, most: float | None = None
    ) -> Measurement:
        """Note a measurement; outside of its range it fails the case at its end."""
        measurement = Measurement(name, value, unit, least, most)
        self.measurements.append(measurement)
        return measurement

    # The table in motion

    def settings(self, top_deg_s: float, rate_deg_s2: float) -> None:
        """Set S and A for the motions to come."""
        self.set_speed(top_deg_s)
        self.set_acceleration(rate_deg_s2)

    def set_speed(self, top_deg_s: float) -> None:
        """Set S."""
        self.expect(b"S %s" % number(top_deg_s))
        self.top_deg_s = top_deg_s

    def set_acceleration(self, rate_deg_s2: float) -> None:
        """Set A."""
        self.expect(b"A %s" % number(rate_deg_s2))
        self.rate_deg_s2 = rate_deg_s2

    def full_settings(self) -> None:
        """Set S and A to the most that the profile allows."""
        self.settings(self.profile.motion.speed_deg_s, self.profile.motion.acceleration_deg_s2)

    def go_home(self) -> None:
        """Bring the table to rest where the session began: there its reference is known."""
        self.full_settings()
        self.expect(b"P %d" % self.home_deg)
        self.wait_for_rest()

    def stand_at_home(self) -> None:
        """Take it that the table rests at home; what was seen of its motion before is forgotten."""
        self.motion = MotionRecord()
        self.stand_at(self.home_deg)

    def stand_at(self, angle_deg: float) -> None:
        """Take it that the reference rests at an angle."""
        resting = Expectation(self.wire.clock.now_s(), Motion(angle_deg, 0.0, angle_deg, ()))
        self.motion.expectations.append(resting)
        self._courses = [self.motion.expectations, *([resting] for _ in _DELAYS[1:])]

    def move_to(self, angle_deg: float) -> None:
        """Command P, relative to home."""
        target = self.home_deg + angle_deg
        self._move(b"P %s" % number(target), lambda _: target)

    def move_by(self, angle_deg: float) -> None:
        """Command R."""
        self._move(b"R %s" % number(angle_deg), lambda position: position + angle_deg)

    def reference_at(self, time_s: float) -> tuple[float, float]:
        """Return where the reference should be at a time, and its speed."""
        return _reference(self.motion.expectations, time_s)

    def follow(self, duration_s: float | None = None) -> None:
        """Read the position again and again: for a time, or until the profile should be over."""
        last = self.motion.expectations[-1]
        begin_s = self.wire.clock.now_s()
        end_s = last.began_s + last.motion.duration_s if duration_s is None else begin_s + duration_s
        while self.wire.clock.now_s() < end_s:
            asked_s = self.wire.clock.now_s()
            self.sample()
            # On a line that costs no time, neither floods the table nor stands still in simulated time.
            self.wire.clock.sleep_s(max(0.0, asked_s + _POLL_S - self.wire.clock.now_s()))

    def sample(self) -> Sample:
        """Read the position, and note it with its time."""
        sent_s = self.wire.send(b"H" + CR)
        reply = self.reply_to(b"H")
        # Clause 4.2/2: between the arrival of the CR and the first byte of the reply.
        earliest_s = min(sent_s + 2 * self.profile.byte_s, reply.first_s)
        latest_s = max(reply.first_s - self.profile.byte_s, earliest_s)
        sample = Sample(
            (earliest_s + latest_s) / 2, float(self.angle_in(reply)), (latest_s - earliest_s) / 2 + self._jitter_s
        )
        self.motion.samples.append(sample)
        return sample

    def finish(self, name: str = "rest") -> None:
        """Follow the motion to its end and past it, and hold what was seen against what was expected."""
        self.follow()
        self.wait_for_rest()
        self.check_tracking(name)
        self.check_rest(name)

    def check_tracking(self, name: str) -> None:
        """Measure the greatest difference between what was seen and the trapezoid, beyond what the times leave open."""
        worst = max((self.excess(sample) for sample in self.motion.samples), default=0.0)
        self.measure(f"{name}: from the trapezoid", worst, "deg", most=self.profile.tolerance.tracking_deg)

    def check_rest(self, name: str) -> None:
        """Measure where the table stands, from the target."""
        target = self.motion.expectations[-1].motion.target_deg
        low, high = self.resting_range()
        self.measure(f"{name}: from the target", float(self.read()) - target, "deg", low - target, high - target)

    def resting_range(self) -> tuple[float, float]:
        """Return where the table may say that it rests; the target of an increment is as open as its moment."""
        targets = [course[-1].motion.target_deg for course in self._courses]
        allowed = self.profile.tolerance.rest_deg + self.profile.resolution_deg / 2
        return min(targets) - allowed, max(targets) + allowed

    def wait_for_rest(self) -> Decimal:
        """Return the position once it stays the same."""
        readings: list[Decimal] = []
        allowed = self.profile.motion
        deadline_s = self.wire.clock.now_s() + _REST_TIMEOUT_S + 2 * allowed.reach_deg / allowed.speed_deg_s
        while len(readings) < _REST_READINGS or len(set(readings[-_REST_READINGS:])) > 1:
            require(self.wire.clock.now_s() < deadline_s, f"the table does not come to rest: {readings[-3:]}")
            if readings:
                self.wire.clock.sleep_s(_REST_INTERVAL_S)
            readings.append(self.read())
        return readings[-1]

    def unmoved(self, because: Sequence[bytes] | bytes) -> "Unmoved":
        """Require that the table stands still over a `with` block."""
        return Unmoved(self, because)

    @property
    def _jitter_s(self) -> float:
        """How far a measured time may be off: that of a simulated clock is exact to a tick."""
        return self.profile.serial.latency_s / 4

    def _timed(self, command: bytes) -> tuple[float, float]:
        """Carry out a command; return the middle and the half width of the time at which the table did."""
        sent_s = self.wire.send(command + CR)
        reply = self.reply_to(command)
        require(reply.text == b"OK", f"{command!r} got {reply.text!r}, not b'OK'")
        earliest_s = min(sent_s + (len(command) + 1) * self.profile.byte_s, reply.first_s)
        latest_s = max(reply.first_s - self.profile.byte_s, earliest_s)
        return (earliest_s + latest_s) / 2, (latest_s - earliest_s) / 2 + self._jitter_s

    def _move(self, command: bytes, target_from: Callable[[float], float]) -> None:
        """Carry out a motion command, and plan what follows from it for each time at which the table may have."""
        middle_s, window_s = self._timed(command)
        for course, delays in zip(self._courses, _DELAYS, strict=True):
            began_s = middle_s + window_s * delays[len(course) % len(delays)]
            position, speed = _reference(course, began_s)
            motion = plan(position, speed, target_from(position), self.top_deg_s, self.rate_deg_s2)
            course.append(Expectation(began_s, motion))

    def excess(self, sample: Sample) -> float:
        """Return how far a sample is from where the reference can have been, with all times as they may have been."""
        window_s = sample.uncertainty_s
        positions = [
            _reference(course, sample.time_s + offset_s)[0]
            for course in self._courses
            for offset_s in (-window_s, 0.0, window_s)
        ]
        half_deg = self.profile.resolution_deg / 2
        low, high = min(positions) - half_deg, max(positions) + half_deg
        return max(low - sample.position_deg, sample.position_deg - high, 0.0)


class Unmoved:
    """A `with` block in which the table must not move."""

    def __init__(self, rig: Rig, because: Sequence[bytes] | bytes) -> None:
        self._rig = rig
        self._because = because

    def __enter__(self) -> None:
        self._before = self._rig.read()

    def __exit__(self, kind: type[BaseException] | None, *_: object) -> None:
        if kind is None:
            self._rig.wire.clock.sleep_s(0.15)  # at 10 deg/s2 a table makes 0.11 deg in it
            after = self._rig.read()
            require(
                abs(after - self._before) <= Decimal(1).scaleb(-self._rig.profile.serial.decimals),
                f"{self._because!r} moved the table from {self._before} to {after} deg",
            )


def _reference(course: Sequence[Expectation], time_s: float) -> tuple[float, float]:
    """Return where a reference is at a time, and its speed."""
    running = next((one for one in reversed(course) if one.began_s <= time_s), course[0])
    return running.at(time_s)


def require(condition: bool, otherwise: str) -> None:
    """Raise NonconformityError unless the condition holds."""
    if not condition:
        raise NonconformityError(otherwise)


def number(value: float) -> bytes:
    """Return a number as it goes on the wire, to four decimals at most."""
    return f"{value:.4f}".rstrip("0").removesuffix(".").encode()
