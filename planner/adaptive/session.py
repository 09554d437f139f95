"""A session: ask the policy for strips, scan them, hand back what the probe returned, until nothing is worth a strip.

The table and the probe are behind `Carrier`, so that a session can be run against anything that scans strips.
"""

from collections.abc import Callable, Sequence
from typing import NamedTuple, Protocol

from planner.adaptive.policy import Policy, PolicyError, Returned
from planner.adaptive.strip import Strip
from planner.cell.obstacles import Obstacle
from planner.errors import PlannerError


class CarrierError(PlannerError):
    """Table or probe cannot go on: the session ends, and what was scanned is kept."""


class Carrier(Protocol):
    """Carries strips out."""

    def ordered(self, strips: Sequence[Strip], solid: Obstacle) -> Sequence[Strip]:
        """Return the strips in the order in which they are to be scanned, each in the direction that suits."""
        ...

    def scan(self, strip: Strip, solid: Obstacle) -> Returned | str:
        """Scan one strip past something solid, and return what the probe returned, or why it cannot be scanned.

        Raises:
            CarrierError: Something failed that will not be better with the next strip.
        """
        ...


class Step(NamedTuple):
    """One strip of a session.

    Attributes:
        strip: As it was scanned.
        refusal: Why it was not scanned; None when it was.
    """

    strip: Strip
    refusal: str | None


class Session(NamedTuple):
    """What a session came to.

    Attributes:
        steps: Its strips, in the order in which they were scanned.
        failure: Why it ended early; None when the policy wanted no more strips, or the maximum number was scanned.
        contradicts: Whether it ended because what was seen contradicts what the policy was made with.
    """

    steps: tuple[Step, ...]
    failure: str | None = None
    contradicts: bool = False


def run_session(
    policy: Policy,
    carrier: Carrier,
    most_strips: int,
    say: Callable[[int, str], None] = lambda _number, _state: None,
    scan_path: Callable[[], Returned] | None = None,
) -> Session:
    """Run a session; Ctrl-C and a policy that cannot go on end it, and what was scanned is kept.

    Args:
        policy: What chooses the strips.
        carrier: What scans them.
        most_strips: How many strips are scanned at most.
        say: Called with the number of strips scanned and the policy's state, at the start and after each.
        scan_path: Scans the predefined path, where there is one.
    """
    steps: list[Step] = []
    try:
        if scan_path is not None:
            policy.take(None, scan_path())
        _scan_all(policy, carrier, most_strips, say, steps)
    except KeyboardInterrupt:
        return Session(tuple(steps), "interrupted")
    except PolicyError as error:
        return Session(tuple(steps), str(error), contradicts=True)
    except CarrierError as error:
        return Session(tuple(steps), str(error))
    return Session(tuple(steps))


def _scan_all(
    policy: Policy, carrier: Carrier, most_strips: int, say: Callable[[int, str], None], steps: list[Step]
) -> None:
    """Scan strips, and append each to `steps`."""
    scanned = 0
    say(0, policy.state())
    while scanned < most_strips and (batch := list(policy.next_strips())[: most_strips - scanned]):
        for strip in carrier.ordered(batch, policy.solid()):
            returned = carrier.scan(strip, policy.solid())
            if isinstance(returned, str):
                policy.refuse(strip, returned)
                steps.append(Step(strip, returned))
                continue
            scanned += 1
            steps.append(Step(strip, None))
            policy.take(strip, returned)
            say(scanned, policy.state())
