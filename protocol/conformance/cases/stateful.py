"""Random walks through the protocol."""

from protocol.conformance.bench.stand import RANDOM_SEARCH
from protocol.conformance.cases.case import case
from protocol.conformance.judgement.rig import Rig


@case("4.1/11:random", RANDOM_SEARCH, travel_deg=60)
def any_sequence_of_commands_is_answered(rig: Rig) -> None:
    """Draw sequences of commands, waits, triggers and readings. A model of the registers predicts each reply."""
    from protocol.conformance.cases.random_walk import walk  # noqa: PLC0415 - it needs hypothesis, which others do without

    walk(rig)
