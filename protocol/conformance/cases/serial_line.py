"""Chapter 2: the serial line."""

from protocol.conformance.case import case
from protocol.conformance.rig import Rig
from protocol.conformance.stand import ERROR_REPLIES, PACING
from protocol.conformance.verdict import require
from protocol.messages import ErrorCode

_TRAIN = 8
"""Commands sent at once, so that their replies follow one another."""

_READS, _OUTLIERS = 20, 2
"""Reads that are timed, and how many of the longest are left to the tester's own machine."""


@case("2.1/1", PACING)
def bytes_take_ten_bits(rig: Rig) -> None:
    """Send several `H` at once, three times; in the slowest train bytes take 10 bit times (a reader may nod off)."""
    trains = [_bits_a_byte(rig) for _ in range(3)]
    slack = rig.profile.serial.latency_s / (7 * _TRAIN * rig.profile.byte_s)
    rig.measure("bit times a byte", max(trains), "bits", least=9.5 * (1 - slack))


@case("2.1/2")
def the_rate_is_as_agreed(rig: Rig) -> None:
    """Read the position at the profile's rate."""
    rig.read()


@case("2.1/3")
def there_is_no_flow_control(rig: Rig) -> None:
    """Send XOFF: it is a bad byte, and the next `H` is answered all the same."""
    rig.refused(b"\x13", ErrorCode.BAD_BYTE)
    rig.read()


@case("2.2/1")
def a_reply_begins_soon(rig: Rig) -> None:
    """Time 20 reads, from the end of the command to the first byte of the reply; all but two must be quick."""
    delays_s = []
    for _ in range(_READS):
        sent_s = rig.wire.send(b"H\r")
        delays_s.append(rig.reply_to(b"H").first_s - sent_s - 3 * rig.profile.byte_s)
    _measure_longest(rig, "longest wait for a reply", delays_s)


@case("2.2/2", travel_deg=20)
def a_reply_does_not_wait_for_a_motion(rig: Rig) -> None:
    """Command a motion; `OK` and the position come while it runs."""
    speed = min(rig.profile.motion.speed_deg_s / 2, 20 / (10 * rig.reading_s))  # ten readings fit the way
    rig.settings(speed, rig.profile.motion.acceleration_deg_s2 / 2)
    sent_s = rig.wire.clock.now_s()
    rig.move_to(20)
    rig.sample()
    waited_s = rig.wire.clock.now_s() - sent_s
    duration_s = rig.motion.expectations[-1].motion.duration_s
    rig.measure("two replies during a motion", waited_s, "s", most=duration_s / 2)
    rig.finish()


@case("2.2/3")
def the_bytes_of_a_reply_come_without_gaps(rig: Rig) -> None:
    """Time the longest gap between two bytes in each of 20 replies; all but two must be short."""
    _measure_longest(rig, "longest gap in a reply", [_idle_s(rig) for _ in range(_READS)])


@case("2.3/1")
def the_buffer_holds_what_it_promises(rig: Rig) -> None:
    """Send a buffer full of `H` at once; each is answered."""
    count = rig.profile.serial.buffer_bytes // 2
    rig.wire.send(b"H\r" * count)
    for _ in range(count):
        rig.angle_in(rig.reply_to(b"H"))
    rig.silence("after the last of them the line")


@case("2.3/2", ERROR_REPLIES)
def a_line_that_lost_bytes_is_a_bad_byte(rig: Rig) -> None:
    """Send five times the buffer at once: each reply is a position, or tells of a bad byte."""
    count = 5 * rig.profile.serial.buffer_bytes // 2
    rig.wire.send(b"H\r" * count)
    heard = rig.drain().split(b"\r")
    rig.wire.send(b"\r")  # ends what may be a torn line: the next case begins without it
    rig.drain()
    require(heard.pop() == b"", "the last reply has no CR")
    strange = [line for line in heard if not line.startswith((b"H ", b"ERR 5 "))]
    require(not strange, f"lines that lost bytes were read as others: {strange[:3]}")
    require(len(heard) <= count, f"{count} lines got {len(heard)} replies")


@case("2.3/3", ERROR_REPLIES)
def lines_after_a_flood_are_read(rig: Rig) -> None:
    """Send five times the buffer at once, wait, end what may be a torn line; the next lines are answered as ever."""
    count = 5 * rig.profile.serial.buffer_bytes // 2
    rig.wire.send(b"H\r" * count)
    rig.drain()
    rig.wire.send(b"\r")
    rig.drain()
    rig.read(b"H")
    rig.read(b"L")


def _measure_longest(rig: Rig, name: str, times_s: list[float]) -> None:
    longest_s = sorted(times_s)[-1 - _OUTLIERS]
    rig.measure(f"{name}, but for {_OUTLIERS}", 1000 * longest_s, "ms", most=10 + 1000 * rig.profile.serial.latency_s)


def _idle_s(rig: Rig) -> float:
    """Return the longest time in a reply in which the line was idle."""
    return max(rig.ask(b"H").gap_s - rig.profile.byte_s, 0.0)


def _bits_a_byte(rig: Rig) -> float:
    rig.wire.send(b"H\r" * _TRAIN)
    replies = [rig.reply_to(b"H") for _ in range(_TRAIN)]
    count = sum(len(reply.text) + 1 for reply in replies) - 1
    return 10 * (replies[-1].last_s - replies[0].first_s) / (count * rig.profile.byte_s)
