"""Chapter 2: the serial line."""

from collections.abc import Callable, Iterator, Sequence
from itertools import cycle, islice

from protocol.conformance.bench.ports import is_simulated
from protocol.conformance.bench.stand import ERROR_REPLIES, PACING
from protocol.conformance.cases.case import case
from protocol.conformance.judgement.rig import Rig
from protocol.conformance.judgement.verdict import require
from protocol.conformance.judgement.wire_checks import number
from protocol.messages import ErrorCode

_TRAIN = 8
"""Number of commands sent at once, so that their replies follow one another."""

_REPLIES, _TIMED_S = 510, 15.0
"""Number of timed replies, as far as a slow line has the time. One late reply in 500 is found."""

_PASSES = 5
"""How often all replies are timed again when one is late: a delay of the testing machine does not occur each time."""


@case("2.1/1", PACING)
def bytes_take_ten_bits(rig: Rig) -> None:
    """Send several `H` at once, three times.

    Bytes in the slowest train take 10 bit times (the receiving program may pause).
    """
    trains = [_bits_a_byte(rig) for _ in range(3)]
    slack = rig.profile.serial.latency_s / (7 * _TRAIN * rig.profile.byte_s)
    rig.measure("bit times a byte", max(trains), "bits", least=9.5 * (1 - slack))


@case("2.1/2")
def the_rate_is_as_agreed(rig: Rig) -> None:
    """Read the position at the profile's rate."""
    rig.read()


@case("2.1/3")
def there_is_no_flow_control(rig: Rig) -> None:
    """Send XOFF: it is a bad byte, and the next `H` still has its reply."""
    rig.refused(b"\x13", ErrorCode.BAD_BYTE)
    rig.read()


@case("2.2/1", travel_deg=2)
def a_reply_begins_soon(rig: Rig) -> None:
    """Time 510 replies of every kind, at rest and in motion: from the end of the command to the reply's first byte."""
    lines = _every_kind(rig)

    def delay_s(line: bytes) -> float:
        sent_s = rig.wire.send(line + b"\r")
        return rig.reply_to(line).first_s - sent_s - (len(line) + 2) * rig.profile.byte_s

    _measure_longest(rig, "wait for a reply", delay_s, _lines_to_time(rig, lines, _REPLIES))


@case("2.2/2", travel_deg=20)
def a_reply_does_not_wait_for_a_motion(rig: Rig) -> None:
    """Command a motion. `OK` and the position are received while it runs."""
    speed = min(rig.profile.motion.speed_deg_s / 2, 20 / (10 * rig.reading_s))  # ten readings fit the motion
    rig.settings(speed, rig.profile.motion.acceleration_deg_s2 / 2)
    sent_s = rig.wire.clock.now_s()
    rig.move_to(20)
    rig.sample()
    waited_s = rig.wire.clock.now_s() - sent_s
    duration_s = rig.motion.expectations[-1].motion.duration_s
    rig.measure("two replies during a motion", waited_s, "s", most=duration_s / 2)
    rig.finish()


@case("2.2/3", travel_deg=2)
def the_bytes_of_a_reply_come_without_gaps(rig: Rig) -> None:
    """Time the longest gap between two bytes in each of 170 replies of every kind, at rest and in motion."""
    lines = _every_kind(rig)

    def idle_s(line: bytes) -> float:
        return max(rig.ask(line).gap_s - rig.profile.byte_s, 0.0)

    _measure_longest(rig, "gap in a reply", idle_s, _lines_to_time(rig, lines, _REPLIES // 3))


@case("2.3/1")
def the_buffer_holds_what_it_promises(rig: Rig) -> None:
    """Send a buffer full of `H` at once. Each has its reply."""
    count = rig.profile.serial.buffer_bytes // 2
    rig.wire.send(b"H\r" * count)
    for _ in range(count):
        rig.angle_in(rig.reply_to(b"H"))
    rig.silence("after the last of them the line")


@case("2.3/2", ERROR_REPLIES)
def a_line_that_lost_bytes_is_a_bad_byte(rig: Rig) -> None:
    """Send five times the buffer at once. Each reply is a position or reports a bad byte."""
    count = 5 * rig.profile.serial.buffer_bytes // 2
    rig.wire.send(b"H\r" * count)
    heard = rig.drain().split(b"\r")
    rig.wire.send(b"\r")  # ends an incomplete line, so that the next case starts without one
    rig.drain()
    require(heard.pop() == b"", "the last reply has no CR")
    strange = [line for line in heard if not line.startswith((b"H ", b"ERR 5 "))]
    require(not strange, f"lines with lost bytes were executed as other lines: {strange[:3]}")
    require(len(heard) <= count, f"{count} lines got {len(heard)} replies")


@case("2.3/3", ERROR_REPLIES)
def lines_after_a_flood_are_read(rig: Rig) -> None:
    """Send five times the buffer at once, wait, and end an incomplete line.

    The next lines have their normal replies.
    """
    count = 5 * rig.profile.serial.buffer_bytes // 2
    rig.wire.send(b"H\r" * count)
    rig.drain()
    rig.wire.send(b"\r")
    rig.drain()
    rig.read(b"H")
    rig.read(b"L")


def _every_kind(rig: Rig) -> tuple[bytes, ...]:
    """Return lines that have every kind of reply, and move the table back and forth by a degree."""
    home, allowed = rig.home_deg, rig.profile.motion
    settings = (b"S " + number(allowed.speed_deg_s), b"A " + number(allowed.acceleration_deg_s2))
    refused = (b"?", b"R x", b"S 0", b"\x18") if rig.profile.serial.error_replies else ()
    return (b"H", b"L", *settings, b"P %d" % (home + 1), b"H", b"R 0.5", b"L", b"P %d" % home, b"R 0", *refused)


def _lines_to_time(rig: Rig, lines: Sequence[bytes], count: int) -> list[bytes]:
    """Return the given number of lines in turn, or as many as a slow line has the time for."""
    return list(islice(cycle(lines), max(len(lines), min(count, int(_TIMED_S / rig.reading_s)))))


def _measure_longest(rig: Rig, name: str, time_of: Callable[[bytes], float], lines: Sequence[bytes]) -> None:
    """Measure the maximum time of lines. On a real line, all lines are timed again when one is late."""
    allowed_s = 0.01 + rig.profile.serial.latency_s
    longest_s: list[float] = []
    while not longest_s or (min(longest_s) > allowed_s and len(longest_s) < _passes(rig)):
        longest_s.append(max(_times_on_a_punctual_machine(rig, time_of, lines)))
    rig.measure(f"longest {name} of {len(lines)}", 1000 * min(longest_s), "ms", most=1000 * allowed_s)


def _passes(rig: Rig) -> int:
    return 1 if is_simulated(rig.wire.port.inner) else _PASSES


def _times_on_a_punctual_machine(
    rig: Rig, time_of: Callable[[bytes], float], lines: Sequence[bytes]
) -> Iterator[float]:
    """Yield the times of lines.

    If the testing machine was late meanwhile, time them once more, and yield that result.
    """
    for line in lines:
        for _ in range(2):
            rig.watch.lap_s()
            time_s = time_of(line)
            if rig.watch.lap_s() <= rig.profile.serial.latency_s:
                break
        yield time_s


def _bits_a_byte(rig: Rig) -> float:
    rig.wire.send(b"H\r" * _TRAIN)
    replies = [rig.reply_to(b"H") for _ in range(_TRAIN)]
    count = sum(len(reply.text) + 1 for reply in replies) - 1
    return 10 * (replies[-1].last_s - replies[0].first_s) / (count * rig.profile.byte_s)
