"""The commands sent to the table and the readings from it in a run."""

from dataclasses import dataclass, field
from typing import NamedTuple

from planner.execution.table_motion import Phase
from protocol.trapezoid import MotionCommand


class Sent(NamedTuple):
    """A motion command that was sent. Times are in s of the motion; `late_s` is the delay against the schedule."""

    time_s: float
    late_s: float
    phase: Phase
    column: int
    command: MotionCommand


class Observation(NamedTuple):
    """A reading of the table, in degrees.

    Attributes:
        time_s: time of the reading, in the time of the motion.
        source: "H", "L", or "inside" for a reading of an emulator's ground truth; "H late" if the reply was so late
            that the time is uncertain.
        encoder_deg: the encoder angle from `source`.
        column: the scan location of the trigger of this reading.
        reference_deg: the controller's reference, if known.
        true_deg: the true angle of the table, if known.
    """

    time_s: float
    source: str
    encoder_deg: float
    column: int | None = None
    reference_deg: float | None = None
    true_deg: float | None = None


class Correction(NamedTuple):
    """From `time_s` on, the stream was computed again: the reference was ahead of its planned position by `slip_deg`.

    The cause is a deviation of the readings (clocks that differ), or a late command.
    """

    time_s: float
    slip_deg: float


@dataclass
class Record:
    """Commands and readings; the record grows during the motion.

    Attributes:
        sent: the motion commands.
        observations: the readings of the table.
        corrections: the points where the stream was changed because of drift.
        failure: why the motion was stopped; None if it was completed.
        has_strayed: whether it was stopped because of a position error of the table.
        origin_s: the client's clock at time 0 of the motion; without meaning in a run that was read from a file.
    """

    sent: list[Sent] = field(default_factory=list)
    observations: list[Observation] = field(default_factory=list)
    corrections: list[Correction] = field(default_factory=list)
    failure: str | None = None
    has_strayed: bool = False
    origin_s: float = 0.0
