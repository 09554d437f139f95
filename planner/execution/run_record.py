"""What was sent to the table and seen of it in a run."""

from dataclasses import dataclass, field
from typing import NamedTuple

from planner.execution.table_motion import Phase
from protocol.trapezoid import MotionCommand


class Sent(NamedTuple):
    """A motion command as it was sent; times in s of the motion, `late_s` against its schedule."""

    time_s: float
    late_s: float
    phase: Phase
    column: int
    command: MotionCommand


class Observation(NamedTuple):
    """Where the table was seen, in degrees.

    Attributes:
        time_s: when, in the time of the motion.
        source: "H", "L", or "inside" for a look that an emulator allowed; "H late" when the answer came so late that
            the time is uncertain.
        encoder_deg: the encoder, as `source` tells it.
        column: the scan location whose trigger this belongs to.
        reference_deg: the controller's reference, where it was told.
        true_deg: the table's own angle, where it was told.
    """

    time_s: float
    source: str
    encoder_deg: float
    column: int | None = None
    reference_deg: float | None = None
    true_deg: float | None = None


class Correction(NamedTuple):
    """From `time_s` on the stream was computed anew: the reference was `slip_deg` ahead of where it was to be.

    By what the readings say (clocks that differ), or because a command came late.
    """

    time_s: float
    slip_deg: float


@dataclass
class Record:
    """What was sent and seen; it grows while the motion runs.

    Attributes:
        sent: the motion commands.
        observations: where the table was seen.
        corrections: where the stream was changed for drift.
        failure: why the motion was stopped; None when it came to its end.
        has_strayed: whether it was stopped because the table was not where it should be.
        origin_s: the client's clock at time 0 of the motion; it means nothing in a run that was read back.
    """

    sent: list[Sent] = field(default_factory=list)
    observations: list[Observation] = field(default_factory=list)
    corrections: list[Correction] = field(default_factory=list)
    failure: str | None = None
    has_strayed: bool = False
    origin_s: float = 0.0
