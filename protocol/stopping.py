"""Stop a moving table: brake at once, with the maximum acceleration, and wait until it stands.

    A 100.0     the maximum A that the table has accepted
    R 3.1       to the nearest point at which it can stand: v |v| / (2 A) from where its reference is
    S 40.0      the maximum S, so that the rest of the motion is short
    R 2.6       the same point

An increment counts from the position of the reference when the table executes it (clause 4.5/1). So the client needs
neither this position nor the time, only the speed. The speed is predicted from the commands that this client sent.

If the speed is unknown (a motion of another client, a table that deviates), `R 0` starts the braking: the table would
return to the point of the command. As soon as its readings show that it reverses, a second `R 0` holds it there.
"""

from contextlib import suppress
from decimal import ROUND_DOWN, Decimal

from protocol.dialogue import Dialogue
from protocol.errors import ArrivalTimeout, NotStopped, ReplyTimeout, TableError, UnexpectedReply
from protocol.messages import Angle, Command, Verb
from protocol.predicted_reference import PredictedReference
from protocol.program.interrupts import signals_wait
from protocol.standstill import Standstill
from protocol.trapezoid import braking_way_deg

BRAKING_DEG_S2 = 100.0
"""The default table's limit of A."""

# A table that may refuse this A receives it first, then lower values. They ascend, because a refused line changes
# nothing.
_SHARES = ((1.0,), (0.25, 0.5, 1.0))
# Maximum braking time of a table of which nothing is known.
_LONGEST_S = 60.0
# Time after the reference's rest until the readings show it.
_SETTLING_S = 2.0
_POLL_S = 0.01
# The number of attempts with a table that replies late, however long they take.
_READINGS = 4
_ATTEMPTS = 3
# Used when nothing is known: the default table's maximum S, and its A at power-on.
_SPEED_DEG_S, _ACCELERATION_DEG_S2 = 40.0, 20.0


def stop(dialogue: Dialogue, braking_deg_s2: float = BRAKING_DEG_S2) -> float:
    """Brake, wait until the table stands, and return its position. Signals are deferred until then.

    Afterwards S and A have their former values, if those are known.

    Args:
        dialogue: the dialogue with the table.
        braking_deg_s2: the maximum A to try when the table has not accepted any yet.

    Raises:
        NotStopped: standstill was not observed. The message states why, and what the table will do.
    """
    before = dialogue.reference
    with signals_wait():
        try:
            position_deg = _stopped(dialogue, braking_deg_s2)
        except TableError as error:
            raise NotStopped(
                f"the table could not be stopped: {error}; {_what_it_will_do(before, dialogue.clock.now_s())}"
            ) from error
        with suppress(TableError):
            _restore(dialogue, before)
    return position_deg


def standing_increment_deg(reference: PredictedReference, rate_deg_s2: float | None, time_s: float) -> float:
    """Return the distance from the position at a time to the nearest point for a stop; 0 if unknown."""
    state = reference.at(time_s)
    return 0.0 if state is None or not rate_deg_s2 else braking_way_deg(state[1], rate_deg_s2)


def _stopped(dialogue: Dialogue, braking_deg_s2: float) -> float:
    """Return the rest position of the table.

    Start again when replies are missing, or when it does not brake as predicted.
    """
    for attempt in range(1, _ATTEMPTS + 1):
        try:
            _brake(dialogue, braking_deg_s2)
            if _is_braked(dialogue):
                dialogue.exchange(_command(Verb.MOVE_BY, 0.0))  # holds it there; at rest it moves nothing
                return _resting_deg(dialogue)
        except (ReplyTimeout, UnexpectedReply):
            if attempt == _ATTEMPTS:
                raise
        for verb in (Verb.SET_SPEED, Verb.SET_ACCELERATION):  # a line was lost or garbled: send it again
            dialogue.reference = dialogue.reference.without_setting(verb)
    position_deg, _ = _position(dialogue)
    raise ArrivalTimeout(f"the table is at {position_deg:g} deg and is still turning", position_deg)


def _brake(dialogue: Dialogue, braking_deg_s2: float) -> None:
    """Start to brake at once, then again with the maximum S: sending S must not delay the braking."""
    rate = dialogue.greatest.get(Verb.SET_ACCELERATION)
    if rate is None:
        for shares in _SHARES:
            asked = [_command(Verb.SET_ACCELERATION, share * braking_deg_s2) for share in shares]
            _move_to_standstill(dialogue, asked)
        dialogue.reference = dialogue.reference._replace(acceleration_deg_s2=None)  # which one it executed is unknown
    else:
        is_set = rate == dialogue.reference.acceleration_deg_s2
        _move_to_standstill(dialogue, [] if is_set else [_command(Verb.SET_ACCELERATION, rate)])
    top = dialogue.greatest.get(Verb.SET_SPEED)
    if top not in {None, dialogue.reference.speed_deg_s}:
        _move_to_standstill(dialogue, [_command(Verb.SET_SPEED, top)])


def _move_to_standstill(dialogue: Dialogue, settings: list[Command]) -> None:
    """Send settings, and an increment to the point at which the table can stand when it has arrived."""
    arrival_s = dialogue.arrival_s([*settings, _command(Verb.MOVE_BY, 1.0)])
    rate = dialogue.greatest.get(Verb.SET_ACCELERATION)
    increment_deg = Decimal(repr(standing_increment_deg(dialogue.reference, rate, arrival_s)))
    # Rounded toward the table: it returns by a digit rather than moving on by one.
    rounded_deg = increment_deg.quantize(Decimal(1).scaleb(-dialogue.decimals), ROUND_DOWN)
    dialogue.send_at_once([*settings, Command(Verb.MOVE_BY, rounded_deg)])


def _is_braked(dialogue: Dialogue) -> bool:
    """Return True when the table stands or reverses, False when it deviates from the prediction."""
    rest_s = dialogue.reference.rests_s
    rate = dialogue.reference.acceleration_deg_s2
    top = dialogue.greatest.get(Verb.SET_SPEED, _SPEED_DEG_S)
    longest_s = top / rate if rate else _LONGEST_S
    latest_s = dialogue.clock.now_s() + longest_s if rest_s is None else rest_s
    _, step_deg = _position(dialogue)
    asked_s = dialogue.clock.now_s()
    position_deg, _ = _position(dialogue)
    reading_s = dialogue.clock.now_s() - asked_s
    deadline_s = max(latest_s, dialogue.clock.now_s()) + _SETTLING_S + _READINGS * reading_s
    standstill = Standstill(rate or _ACCELERATION_DEG_S2, step_deg)
    while dialogue.clock.now_s() < deadline_s:
        standstill.take(dialogue.clock.now_s(), position_deg)
        if rest_s is not None and dialogue.reference.rests_s is None:
            return False
        if dialogue.clock.now_s() >= (rest_s or 0.0) and (standstill.has_paused or standstill.has_turned):
            return True
        dialogue.clock.sleep_s(_POLL_S)
        position_deg, _ = _position(dialogue)
    return False


def _resting_deg(dialogue: Dialogue) -> float:
    """Return the position when it no longer changes.

    Raises:
        ArrivalTimeout: the position still changes.
    """
    deadline_s = dialogue.clock.now_s() + _LONGEST_S
    position_deg, step_deg = _position(dialogue)
    standstill = Standstill(dialogue.reference.acceleration_deg_s2 or _ACCELERATION_DEG_S2, step_deg)
    while not standstill.stands:
        position_deg, _ = _position(dialogue)
        standstill.take(dialogue.clock.now_s(), position_deg)
        if dialogue.clock.now_s() > deadline_s:
            raise ArrivalTimeout(f"the table is at {position_deg:g} deg and is still turning", position_deg)
        dialogue.clock.sleep_s(_POLL_S)
    dialogue.rests_at(position_deg)
    return position_deg


def _position(dialogue: Dialogue) -> tuple[float, float]:
    """Return the table's position, and the unit of its last decimal."""
    reply = dialogue.exchange(Command(Verb.READ_POSITION))
    assert isinstance(reply, Angle)
    exponent = reply.angle_deg.as_tuple().exponent
    assert isinstance(exponent, int)
    return float(reply.angle_deg), 10.0**exponent


def _restore(dialogue: Dialogue, before: PredictedReference) -> None:
    """Set S and A to their former values, if those are known: nobody requested others."""
    now = dialogue.reference
    if before.acceleration_deg_s2 not in {None, now.acceleration_deg_s2}:
        dialogue.exchange(_command(Verb.SET_ACCELERATION, before.acceleration_deg_s2))
    if before.speed_deg_s not in {None, now.speed_deg_s}:
        dialogue.exchange(_command(Verb.SET_SPEED, before.speed_deg_s))


def _what_it_will_do(before: PredictedReference, now_s: float) -> str:
    """Return as text what a table does that did not receive the stop."""
    otherwise = "if the table did not receive the stop, it continues to"
    if before.target_deg is None:
        return f"{otherwise} its last target, and stops there"
    when = "" if before.rests_s is None else f" within {max(0.0, before.rests_s - now_s):.1f} s"
    return f"{otherwise} its last target, {before.target_deg:g} deg, and stops there{when}"


def _command(verb: Verb, value: float) -> Command:
    return Command(verb, Decimal(repr(value)))
