"""The interface of a case: the table's line, its measured and expected motion, and a list of measurements."""

from collections.abc import Callable
from contextlib import suppress
from decimal import Decimal
from math import ceil, sqrt
from random import Random

from protocol.bench import BenchError
from protocol.conformance.bench.host_watch import Punctual, Watch
from protocol.conformance.bench.stand import Stand
from protocol.conformance.bench.wire import CR, Line, Wire
from protocol.conformance.judgement.reference import Instant, MotionRecord, Reference, Sample
from protocol.conformance.judgement.verdict import Measurement, NonconformityError, require
from protocol.conformance.judgement.wire_checks import WireChecks, number
from protocol.conformance.profile.profile import Profile

_POLL_S = 0.005
_REST_READINGS = 5
_REST_INTERVAL_S = 0.05
_REST_TIMEOUT_S = 30.0
_FAR_S = 0.8
"""Time for which a motion to a far target is observed."""
_READING_BYTES = 10
"""Number of bytes of `H` and of a reply with three digits, without its decimals."""
_LEAST_SHARE = 0.1
"""The minimum speed and acceleration that a case sets, as a share of the profile's."""


class Rig(WireChecks):
    """One case's access to the table.

    Attributes:
        home_deg: position at the start of the session. Each moving case starts there.
        measurements: the measured values.
        motion: measured and expected values of the table's motion.
        top_deg_s: the last value of S.
        rate_deg_s2: the last value of A.
        chance: random generator with a fixed seed.
        watch: scheduling delay of the testing machine.
    """

    def __init__(
        self, wire: Wire, profile: Profile, stand: Stand, home_deg: int, chance: Random, watch: Watch | None = None
    ) -> None:
        super().__init__(wire, profile)
        self.watch = watch or Punctual()
        self.stand = stand
        self.home_deg = home_deg
        self.chance = chance
        self.measurements: list[Measurement] = []
        self.top_deg_s = self.rate_deg_s2 = 0.0
        self.motion = MotionRecord()
        self._reference = Reference(self.motion.expectations)

    def measure(
        self, name: str, value: float, unit: str, least: float | None = None, most: float | None = None
    ) -> Measurement:
        """Store a measurement. A value outside of its range fails the case at its end."""
        measurement = Measurement(name, value, unit, least, most)
        self.measurements.append(measurement)
        return measurement

    def settings(self, top_deg_s: float, rate_deg_s2: float) -> None:
        """Set S and A for the following motions."""
        self.set_speed(top_deg_s)
        self.set_acceleration(rate_deg_s2)

    def set_speed(self, top_deg_s: float) -> None:
        """Set S."""
        self.set_speed_text(number(top_deg_s))

    def set_speed_text(self, text: bytes) -> None:
        """Set S to a number as text."""
        self.expect(b"S " + text)
        self.top_deg_s = float(text)

    def set_acceleration(self, rate_deg_s2: float) -> None:
        """Set A."""
        self.set_acceleration_text(number(rate_deg_s2))

    def set_acceleration_text(self, text: bytes) -> None:
        """Set A to a number as text."""
        self.expect(b"A " + text)
        self.rate_deg_s2 = float(text)

    def full_settings(self) -> None:
        """Set S and A to the maximum that the profile allows."""
        self.settings(self.profile.motion.speed_deg_s, self.profile.motion.acceleration_deg_s2)

    def go_home(self) -> None:
        """Bring the table to rest at the start position of the session, where its reference is known."""
        self.full_settings()
        self.expect(b"P %d" % self.home_deg)
        self.wait_for_rest()

    def stand_at_home(self) -> None:
        """Assume that the table rests at its home position, and discard the earlier readings of its motion."""
        self.stand_afresh_at(self.home_deg)

    def stand_afresh_at(self, angle_deg: float) -> None:
        """Assume that the table rests at an angle, and discard the earlier readings of its motion."""
        self.motion = MotionRecord()
        self._reference = Reference(self.motion.expectations)
        self.stand_at(angle_deg)

    def stand_at(self, angle_deg: float) -> None:
        """Assume that the reference rests at an angle."""
        self._reference.stand_at(self.wire.clock.now_s(), angle_deg)

    def power_cycle(self) -> None:
        """Switch the table off and on while it rests.

        Home stays the same place, although the table reports another angle there.
        """
        before = self.read()
        try:
            self.stand.power_cycle()
        except BenchError:
            with suppress(NonconformityError):  # report what the switch did not do
                self.home_deg += round(self.read() - before)
            raise
        self.home_deg -= round(before)  # the position should be 0 now, even if the next reply is missing
        self.home_deg += round(self.read())

    def move_to(self, angle_deg: float) -> None:
        """Command P, relative to home."""
        self.move_to_text(number(self.home_deg + angle_deg))

    def move_to_text(self, text: bytes) -> None:
        """Command P with a number as text."""
        self._move(b"P " + text, lambda _: float(text))

    def move_by(self, angle_deg: float) -> None:
        """Command R."""
        self.move_by_text(number(angle_deg))

    def move_by_text(self, text: bytes) -> None:
        """Command R with a number as text."""
        self._move(b"R " + text, lambda position: position + float(text))

    def begin_far_motion(self, command: bytes) -> None:
        """Start a slow motion to a far target with a whole P or R, observe its first part, and stop it."""
        letter, text = command[:2], command[2:]
        self.settings(min(2, self.profile.motion.speed_deg_s), self.profile.motion.acceleration_deg_s2)
        (self.move_to_text if letter == b"P " else self.move_by_text)(text)
        self.follow(_FAR_S)
        self.move_by(0)
        self.finish(command.decode())

    def reference_at(self, time_s: float) -> tuple[float, float]:
        """Return the position of the reference at a time, and its speed."""
        return self._reference.at(time_s)

    def follow(self, duration_s: float | None = None) -> None:
        """Read the position repeatedly: for a time, or until the profile should have ended."""
        last = self.motion.expectations[-1]
        begin_s = self.wire.clock.now_s()
        end_s = last.began_s + last.motion.duration_s if duration_s is None else begin_s + duration_s
        while self.wire.clock.now_s() < end_s:
            asked_s = self.wire.clock.now_s()
            self.sample()
            # A line without transmission time: the table is not flooded, and simulated time still passes.
            self.wire.clock.sleep_s(max(0.0, asked_s + _POLL_S - self.wire.clock.now_s()))

    def sample(self) -> Sample:
        """Read the position, and store it with its time."""
        sent_s = self.wire.send(b"H" + CR)
        reply = self.reply_to(b"H")
        # Clause 4.2/2: the reading is taken between the arrival of the CR and the first byte of the reply.
        instant = self._instant(sent_s, len(b"H" + CR), reply)
        sample = Sample(instant.middle_s, float(self.angle_in(reply)), instant.half_width_s)
        self.motion.samples.append(sample)
        return sample

    def finish(self, name: str = "rest") -> None:
        """Follow the motion to its end and past it, and compare the measured with the expected values."""
        self.follow()
        self.wait_for_rest()
        self.check_tracking(name)
        self.check_rest(name)

    def check_tracking(self, name: str) -> None:
        """Measure the maximum deviation from the trapezoid, minus the part that the uncertain times explain."""
        worst = max((self.excess(sample) for sample in self.motion.samples), default=0.0)
        self.measure(f"{name}: deviation from the trapezoid", worst, "deg", most=self.profile.tolerance.tracking_deg)

    def check_rest(self, name: str) -> None:
        """Measure the distance of the resting table from its target.

        The target of an increment is as uncertain as its time.
        """
        low, high = self._reference.target_span_deg()
        position = float(self.read())
        away = position - min(max(position, low), high)
        self.measure(f"{name}: deviation from the target", away, "deg", *self.near(0))

    def excess(self, sample: Sample) -> float:
        """Return the distance of a sample from the possible positions of the reference, for all possible times."""
        low, high = self._reference.span_deg(Instant(sample.time_s, sample.uncertainty_s))
        half_deg = self.profile.resolution_deg / 2
        return max(low - half_deg - sample.position_deg, sample.position_deg - (high + half_deg), 0.0)

    def resting_range(self) -> tuple[float, float]:
        """Return the range in which the table may report its rest position.

        The target of an increment is as uncertain as its time.
        """
        low, high = self._reference.target_span_deg()
        return self.near(low)[0], self.near(high)[1]

    def near(self, target_deg: float) -> tuple[float, float]:
        """Return the range in which a table that rests at a target may report its position."""
        allowed = self.profile.tolerance.rest_deg + self.profile.resolution_deg / 2
        return target_deg - allowed, target_deg + allowed

    def wait_for_rest(self) -> Decimal:
        """Return the position when it no longer changes."""
        readings: list[Decimal] = []
        allowed = self.profile.motion
        deadline_s = self.wire.clock.now_s() + _REST_TIMEOUT_S + 2 * allowed.reach_deg / allowed.speed_deg_s
        wanted = self._readings_at_rest()
        while len(readings) < wanted or len(set(readings[-wanted:])) > 1:
            require(self.wire.clock.now_s() < deadline_s, f"the table did not come to rest: {readings[-3:]}")
            if readings:
                self.wire.clock.sleep_s(_REST_INTERVAL_S)
            readings.append(self.read())
        return readings[-1]

    def _readings_at_rest(self) -> int:
        """Return how many equal readings show a rest. A slow motion gives several, most of them where it reverses."""
        allowed, step_deg = self.profile.motion, self.profile.step_deg
        cruising_s = step_deg / (self.top_deg_s or _LEAST_SHARE * allowed.speed_deg_s)
        turning_s = 2 * sqrt(2 * step_deg / (self.rate_deg_s2 or _LEAST_SHARE * allowed.acceleration_deg_s2))
        return max(_REST_READINGS, 2 + ceil(max(cruising_s, turning_s) / _REST_INTERVAL_S))

    def _move(self, command: bytes, target_from: Callable[[float], float]) -> None:
        """Send a motion command, and follow its possible courses."""
        sent_s = self.wire.send(command + CR)
        reply = self.reply_to(command)
        require(reply.text == b"OK", f"{command!r} got {reply.text!r}, not b'OK'")
        instant = self._instant(sent_s, len(command + CR), reply)
        self._reference.move(instant, target_from, self.top_deg_s, self.rate_deg_s2)

    def _instant(self, sent_s: float, byte_count: int, reply: Line) -> Instant:
        """Return the window in which a table executed a line: from its CR to the first byte of the reply."""
        earliest_s = min(sent_s + byte_count * self.profile.byte_s, reply.first_s)
        latest_s = max(reply.first_s - self.profile.byte_s, earliest_s)
        return Instant((earliest_s + latest_s) / 2, (latest_s - earliest_s) / 2 + self._jitter_s)

    @property
    def reading_s(self) -> float:
        """Maximum time for reading the position: the bytes in both directions, and the latency."""
        serial = self.profile.serial
        return (_READING_BYTES + serial.decimals) * self.profile.byte_s + serial.latency_s

    @property
    def _jitter_s(self) -> float:
        """Error of a measured time. The time of a simulated clock is exact to a tick."""
        return self.profile.serial.latency_s / 4


def cruising_speed(distance_deg: float, rate_deg_s2: float) -> float:
    """Return the maximum speed that a motion from rest to rest keeps for a third of its travel."""
    return sqrt(rate_deg_s2 * distance_deg * 2 / 3)
