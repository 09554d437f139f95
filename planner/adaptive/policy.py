"""What chooses the strips of a session: a policy, which has only what it was made with and what the probe returned.

A session repeats: ask the policy for strips, plan and scan them one after the other, hand back what the probe returned.
Everything that a policy decides about the workpiece is its own: with a mesh (`planner.adaptive.known_part`), or from
the points alone. A session plans against `Policy.solid`, and never against a mesh that the policy does not have.
"""

from collections.abc import Sequence
from typing import NamedTuple, Protocol

from planner.adaptive.strip import Strip
from planner.arrays import FloatArray, IndexArray
from planner.cell.obstacles import Obstacle
from planner.errors import PlannerError


class PolicyError(PlannerError):
    """A policy cannot go on: the session ends, and what was scanned is kept."""


class Returned(NamedTuple):
    """What the probe returned along one path, aligned with what was latched and calibrated: nothing in it is true.

    Attributes:
        T_WS: `(n, 4, 4)` poses of the probe in the workpiece's frame at the profiles, in mm.
        profiles: `(m,)` the profile that each point belongs to, an index into `T_WS`.
        points_W: `(m, 3)` measured points in the workpiece's frame, in mm, with the probe's noise.
    """

    T_WS: FloatArray
    profiles: IndexArray
    points_W: FloatArray


class Policy(Protocol):
    """Chooses the next strips from what the probe returned so far."""

    def next_strips(self) -> Sequence[Strip]:
        """Return strips to scan next, best first; none when nothing more is worth a strip.

        The session scans a batch in the order with the shortest time, then asks again.
        """
        ...

    def take(self, strip: Strip | None, returned: Returned) -> None:
        """Take in what the probe returned along a strip, or along the predefined path (None).

        Raises:
            PolicyError: What was returned contradicts what the policy was made with.
        """
        ...

    def refuse(self, strip: Strip, reason: str) -> None:
        """Learn that a strip cannot be carried out; it must not be returned again."""
        ...

    def solid(self) -> Obstacle:
        """Return what counts as solid where the workpiece is, at this moment: strips are planned around it.

        It has the pose of the workpiece on the table (`Cell.T_TW`), and turns with the table.
        """
        ...

    def state(self) -> str:
        """Return in a few words how far the policy is, for the progress line, such as `97.1 % of what can be seen`."""
        ...
