"""Chapter 8: the rules that let a client resynchronize."""

from protocol.client import TableClient
from protocol.conformance.bench.stand import ERROR_REPLIES
from protocol.conformance.cases.case import case
from protocol.conformance.judgement.reference import Sample
from protocol.conformance.judgement.rig import Rig
from protocol.conformance.judgement.verdict import NonconformityError, require
from protocol.errors import ReplyTimeout, UnexpectedReply
from protocol.messages import ErrorCode


@case("8.1/1")
def a_client_may_have_64_bytes_unanswered(rig: Rig) -> None:
    """Send 64 bytes of `H` and `L` in turn. Each has its reply, in order."""
    rig.wire.send(b"H\rL\r" * 16)
    for letter in (b"H", b"L") * 16:
        rig.angle_in(rig.reply_to(letter), letter)


@case("8.3/1", ERROR_REPLIES)
def cancel_ends_a_half_line(rig: Rig) -> None:
    """Send an incomplete motion command, CAN and CR, and read the position: the incomplete line is not executed."""
    with rig.unmoved(b"R 5 and CAN"):
        rig.wire.send(b"R 5")
        rig.refused(b"\x18", ErrorCode.BAD_BYTE)


@case("8.3/2", travel_deg=20)
def late_replies_are_told_apart(rig: Rig) -> None:
    """Leave two replies unread during a motion, as an earlier client may.

    The client then reads the present position.
    """
    rig.settings(rig.profile.motion.speed_deg_s / 2, rig.profile.motion.acceleration_deg_s2 / 2)
    rig.move_to(20)
    rig.follow(0.5)
    rig.wire.send(b"H\rL\r")
    _client_reads(rig)
    rig.finish()


@case("8.3/3", ERROR_REPLIES)
def a_client_finds_its_place_after_noise(rig: Rig) -> None:
    """Send noise without CAN or CR. The client resynchronizes by the rules of 8.3."""
    rig.wire.send(bytes(rig.chance.randrange(0x80, 0x100) for _ in range(20)))
    position = _client_reads(rig)
    own = rig.read()
    require(position == float(own), f"the client read {position}, the suite {own}")


@case("8.3/4", travel_deg=20)
def a_stop_is_heard_at_once(rig: Rig) -> None:
    """Leave replies unread during a motion, and send CAN, CR and `R 0`: the table stops and returns."""
    rig.settings(min(rig.profile.motion.speed_deg_s / 2, 4), rig.profile.motion.acceleration_deg_s2 / 2)
    rig.move_to(20)
    rig.follow(0.5)
    rig.wire.send(b"H\rH\rH")
    rig.wire.send(b"\x18\rR 0\r")
    rig.drain()
    stopped = float(rig.wait_for_rest()) - rig.home_deg
    rig.measure("after R 0", stopped, "deg", most=15)


def _client_reads(rig: Rig) -> float:
    """Return the position that a client reads. During a motion it is compared with the trapezoid."""
    client = TableClient(rig.wire.port, rig.profile.serial.timeout_s)
    try:
        position = client.position_deg()
    except (ReplyTimeout, UnexpectedReply) as error:
        raise NonconformityError(f"the client does not resynchronize: {error}") from error
    asked_s = next(event.time_s for event in reversed(rig.wire.port.events) if event.direction == "sent")
    heard_s = rig.wire.clock.now_s()
    if rig.motion.expectations:
        rig.motion.samples.append(Sample((asked_s + heard_s) / 2, position, (heard_s - asked_s) / 2))
    rig.silence("after the client resynchronized, the line")
    return position
