"""Chapter 6: the registers and the latch."""

from decimal import ROUND_HALF_EVEN, Decimal

from protocol.conformance.bench.stand import OBSERVER, POWER_CYCLE, PRESET, TRIGGER
from protocol.conformance.cases.case import case
from protocol.conformance.judgement.rig import Rig
from protocol.conformance.judgement.verdict import require
from protocol.conformance.judgement.wire_checks import number

_ODD_SHARE = 0.9371
"""Share of the full speed at which the resolution of a reading and the travel of a tick have no common measure."""
_LESS_THAN_A_TICK_S = 1e-6
"""A wait of this length takes one tick of a simulated table."""


@case("6.1/1", TRIGGER, travel_deg=10)
def position_and_latch_are_two_registers(rig: Rig) -> None:
    """Latch, then move: the position follows the motion, the latch stays."""
    rig.stand.trigger()
    latched = rig.read(b"L")
    rig.move_to(10)
    rig.finish()
    later = rig.read(b"L")
    require(later == latched, f"the latch went from {latched} to {later} deg without a trigger")


@case("6.1/2", PRESET, travel_deg=5)
def a_position_is_exact_at_both_ends(rig: Rig) -> None:
    """Preset the counter near each of its limits, and move to a position that is nearer still."""
    last = rig.profile.range_deg
    for begin, target in ((last - 5, last - 1.7), (5 - last, 1.7 - last)):
        rig.stand.preset(round(begin * rig.profile.table.counts_per_deg))
        rig.full_settings()
        rig.expect(b"P " + number(target))
        rig.wait_for_rest()
        rig.measure(f"from {target:.1f}", float(rig.read()) - target, "deg", *rig.near(0))


@case("6.1/3", PRESET, travel_deg=10)
def a_register_runs_over_its_end(rig: Rig) -> None:
    """Preset the counter just below its limit, move past it and back: the motion is the same as elsewhere."""
    top = rig.profile.range_deg
    rig.stand.preset(2**31 - round(5 * rig.profile.table.counts_per_deg))
    rig.settings(rig.profile.motion.speed_deg_s / 2, rig.profile.motion.acceleration_deg_s2 / 2)
    rig.stand_at(top - 5)
    allowed = rig.profile.tolerance.rest_deg + rig.profile.resolution_deg
    for way, expected in ((10, -top + 5), (-10, top - 5)):
        rig.move_by(way)
        rig.follow()
        rig.wait_for_rest()
        error = float(rig.read()) - expected
        rig.measure(f"after R {way}, from {expected:.1f}", error, "deg", -allowed, allowed)
    rig.motion.samples[:] = [one._replace(position_deg=one.position_deg % (2 * top)) for one in rig.motion.samples]
    rig.check_tracking("past the limit and back")


@case("6.1/4", travel_deg=200)
def the_table_turns_both_ways(rig: Rig) -> None:
    """Move by more than half a turn forward, and by more than half a turn backward."""
    rig.settings(rig.profile.motion.speed_deg_s, rig.profile.motion.acceleration_deg_s2)
    for target in (200, 0):
        rig.move_to(target)
        rig.finish(f"to {target}")


@case("6.1/5", POWER_CYCLE, travel_deg=5)
def registers_are_0_at_power_on(rig: Rig) -> None:
    """Move, latch if the rig can, switch the table off and on, and read both registers."""
    rig.move_to(5)
    rig.finish()
    if TRIGGER in rig.stand.capabilities:
        rig.stand.trigger()
    rig.power_cycle()
    for letter in (b"H", b"L"):
        angle = rig.read(letter)
        require(angle == 0, f"{letter!r} is {angle} at power-on")


@case("6.2/1", TRIGGER, travel_deg=40)
def a_trigger_latches_the_position(rig: Rig) -> None:
    """At speed in both directions, trigger between two readings, also during commands and replies.

    The latch lies between the readings.
    """
    speed = rig.profile.motion.speed_deg_s / 2
    rig.settings(speed, rig.profile.motion.acceleration_deg_s2)
    worst_deg = 0.0
    for target in (40, 0):
        rig.move_to(target)
        rig.follow(speed / rig.rate_deg_s2 + 0.1)
        for turn in range(8):
            before = rig.sample().position_deg
            _TRIGGERS[turn % len(_TRIGGERS)](rig)
            after = rig.sample().position_deg
            latched = float(rig.read(b"L"))
            worst_deg = max(worst_deg, min(before, after) - latched, latched - max(before, after))
        rig.finish(f"to {target}")
    rig.measure("latch outside of the readings around it", worst_deg, "deg", most=rig.profile.resolution_deg)


@case("6.2/1:instant", OBSERVER, travel_deg=40)
def a_trigger_latches_the_very_instant(rig: Rig) -> None:
    """At full speed, trigger twice within ticks, and where the counter passes 0: the latch equals the encoder."""
    rig.set_speed(_ODD_SHARE * rig.top_deg_s)
    for target in (40, 0):
        rig.move_to(target)
        rig.follow(rig.top_deg_s / rig.rate_deg_s2 + 0.02)
        for turn in range(60):
            rig.stand.trigger_within(0.5)  # another edge overwrites it at once
            _require_latched(rig, rig.stand.trigger_within(rig.chance.random() if turn % 4 else 0.0))
        rig.finish(f"to {target}")
    for share in (0.02, 0.98, 0.0) if rig.home_deg == 0 else ():
        for sign in (1, -1):
            rig.move_to(-2 * sign)
            rig.finish()
            rig.move_to(2 * sign)
            _step_to_the_tick_over_0(rig)
            if share == 0.0:
                rig.wire.clock.sleep_s(_LESS_THAN_A_TICK_S)
            _require_latched(rig, rig.stand.trigger_within(share))
            rig.finish("over 0")


@case("6.2/2", TRIGGER, travel_deg=20)
def each_trigger_overwrites_the_latch(rig: Rig) -> None:
    """Latch at three positions, with two triggers before each reading.

    Then latch twice between two readings, in motion.
    """
    for turn, target in enumerate((10, 20, 0)):
        rig.stand.trigger()
        rig.move_to(target)
        rig.finish(f"at {target}")
        _TRIGGERS[turn + 1](rig)
        error = float(rig.read(b"L") - rig.read())
        rig.measure(
            f"latch at {target} minus position",
            error,
            "deg",
            -rig.profile.resolution_deg,
            rig.profile.resolution_deg,
        )
    rig.move_to(20)
    rig.follow(0.3)
    rig.stand.trigger()
    rig.sample()
    before = rig.sample().position_deg
    rig.stand.trigger()
    after = rig.sample().position_deg
    latched = float(rig.read(b"L"))
    away = max(before - latched, latched - after)
    rig.measure("second latch outside of the readings around it", away, "deg", most=rig.profile.resolution_deg)
    rig.finish()


@case("6.2/2:power-on", POWER_CYCLE, travel_deg=10)
def the_latch_holds_the_position_at_power_on(rig: Rig) -> None:
    """Switch the table off and on, move, and read the latch without a trigger."""
    rig.power_cycle()
    rig.stand_at_home()
    rig.settings(rig.profile.motion.speed_deg_s, rig.profile.motion.acceleration_deg_s2)
    rig.move_to(10)
    rig.finish()
    require(rig.read(b"L") == 0, "the latch is not 0 before the first trigger")


@case("6.2/3", TRIGGER, travel_deg=20)
def a_trigger_disturbs_nothing(rig: Rig) -> None:
    """Trigger repeatedly during a motion, during replies too."""
    rig.settings(rig.profile.motion.speed_deg_s / 2, rig.profile.motion.acceleration_deg_s2 / 2)
    rig.move_to(20)
    for _ in range(20):
        rig.wire.send(b"H\r")
        rig.stand.trigger()
        rig.angle_in(rig.reply_to(b"H"))
        rig.sample()
    rig.finish()


def _trigger_amid_a_command(rig: Rig) -> None:
    """Trigger while bytes of a command are on the line."""
    rig.wire.send(b"H".ljust(20))
    rig.stand.trigger()
    rig.wire.send(b"\r")
    rig.angle_in(rig.reply_to(b"H"))


def _trigger_amid_a_reply(rig: Rig) -> None:
    """Trigger while only a reply is on the line."""
    rig.wire.send(b"H\r")
    rig.wire.clock.sleep_s(5 * rig.profile.byte_s)
    rig.stand.trigger()
    rig.angle_in(rig.reply_to(b"H"))


def _trigger_amid_all(rig: Rig) -> None:
    """Trigger while commands and replies are on the line."""
    rig.wire.send(b"H\r" * 6)
    rig.wire.clock.sleep_s(6 * rig.profile.byte_s)
    rig.stand.trigger()
    for _ in range(6):
        rig.angle_in(rig.reply_to(b"H"))


_TRIGGERS = (lambda rig: rig.stand.trigger(), _trigger_amid_a_command, _trigger_amid_a_reply, _trigger_amid_all)


def _step_to_the_tick_over_0(rig: Rig) -> None:
    """Advance the time until the encoder's count changes its sign within the next tick."""
    last_deg = rig.stand.encoder_deg()
    deadline_s = rig.wire.clock.now_s() + 10
    while rig.wire.clock.now_s() < deadline_s:
        rig.wire.clock.sleep_s(_LESS_THAN_A_TICK_S)
        now_deg = rig.stand.encoder_deg()
        next_deg = 2 * now_deg - last_deg
        if now_deg != 0 and (now_deg < 0) != (next_deg < 0):
            return
        last_deg = now_deg


def _require_latched(rig: Rig, angle_deg: float) -> None:
    """Require that the latch holds an angle, to within one count of the encoder."""
    unit, count_deg = Decimal(1).scaleb(-rig.profile.serial.decimals), 1 / rig.profile.table.counts_per_deg
    low, high = (Decimal(angle_deg + way * count_deg * 1.001).quantize(unit, ROUND_HALF_EVEN) for way in (-1, 1))
    latched = rig.read(b"L")
    require(low <= latched <= high, f"the latch is {latched} deg; at the edge the encoder was at {angle_deg:.4f} deg")
