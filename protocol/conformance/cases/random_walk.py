"""Random walks through the protocol, beside a model of the registers: what no list of cases would think of.

On a simulated table a failing walk is shrunk where it was found. A real table is not made to repeat it: the walk is
drawn again from its seed on the emulator, and shrunk there.
"""

from collections.abc import Callable
from random import Random

from hypothesis import HealthCheck, Phase, Verbosity, seed, settings
from hypothesis.errors import HypothesisException
from hypothesis.stateful import run_state_machine_as_test

from protocol.conformance.bench.ports import SessionError, is_simulated, open_port
from protocol.conformance.bench.stand import stand_beside
from protocol.conformance.bench.wire import RecordedPort, Wire
from protocol.conformance.cases.walk_machine import RandomWalk
from protocol.conformance.judgement.rig import Rig
from protocol.conformance.judgement.verdict import NonconformityError

ON_A_PORT, SIMULATED = (4, 12), (12, 20)
"""Walks, and steps of each: a table that is moved for it is moved little."""
_STAND_IN_URL = "emulator://"


class _FoundError(BaseException):
    """Carries a failure past hypothesis, which would have a real table repeat it."""


def walk(rig: Rig) -> None:
    """Walk at random on the rig's table.

    Raises:
        NonconformityError: the table left the model; the message ends with the steps, the fewest that were found.
    """
    chance = rig.chance.randrange(2**32)
    if is_simulated(rig.wire.port.inner):
        _search_and_shrink(rig, chance, SIMULATED)
        return
    try:
        search(rig, chance, ON_A_PORT, _FoundError)
    except _FoundError as found:
        raise NonconformityError(f"{found}; {_on_the_stand_in(rig, chance)}") from None


def _on_the_stand_in(rig: Rig, chance: int) -> str:
    """Return what the emulator does on the same walks."""
    try:
        port = open_port(_STAND_IN_URL, rig.profile)
    except SessionError:
        return "there is no emulator here on which to shrink it"
    stand = stand_beside(port, None, rig.profile)
    twin = Rig(Wire(RecordedPort(port), rig.profile.byte_s), rig.profile, stand, 0, Random(0))  # noqa: S311  # not used
    try:
        _search_and_shrink(twin, chance, ON_A_PORT)
    except NonconformityError as error:
        return f"on the emulator too: {error}"
    finally:
        port.close()
    return "the emulator walks the same way without fault"


def _search_and_shrink(rig: Rig, chance: int, size: tuple[int, int]) -> None:
    """Raise the shortest failing walk; a table that fails now and then leaves the shortest that it failed."""
    failures: list[str] = []

    def failure(message: str) -> NonconformityError:
        failures.append(message)
        return NonconformityError(message)

    try:
        search(rig, chance, size, failure, Phase.shrink)
    except (NonconformityError, HypothesisException):
        if not failures:
            raise
        raise NonconformityError(min(reversed(failures), key=lambda message: message.count(", "))) from None


def search(
    rig: Rig, chance: int, size: tuple[int, int], failure: Callable[[str], BaseException], *phases: Phase
) -> None:
    """Walk so often, and so many steps each time, drawn from a seed; raise the first `failure`, or shrink it first."""
    walks, steps = size
    machine = type("RandomWalkOfOneRig", (RandomWalk,), {"rig": rig, "failure": staticmethod(failure)})
    run_state_machine_as_test(
        seed(chance)(machine),
        settings=settings(
            max_examples=walks,
            stateful_step_count=steps,
            phases=(Phase.generate, *phases),
            database=None,
            deadline=None,
            print_blob=False,
            verbosity=Verbosity.quiet,
            suppress_health_check=list(HealthCheck),
        ),
    )
