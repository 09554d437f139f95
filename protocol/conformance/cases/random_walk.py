"""Random walks through the protocol, compared with a model of the registers. They find sequences that nobody listed.

On a simulated table, a failing walk is shrunk on that table. A real table does not repeat it: the walk is drawn again
from its seed on the emulator, and shrunk there.
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
"""The number of walks, and of steps in each. A real table makes fewer moves."""
_STAND_IN_URL = "emulator://"


class _FoundError(BaseException):
    """Carries a failure past hypothesis, which would make a real table repeat it."""


def walk(rig: Rig) -> None:
    """Run random walks on the rig's table.

    Raises:
        NonconformityError: the table contradicts the model. The message ends with the shortest sequence of steps that
            was found.
    """
    chance = rig.chance.randrange(2**32)
    if is_simulated(rig.wire.port.inner):
        _search_and_shrink(rig, chance, SIMULATED)
        return
    try:
        search(rig, chance, ON_A_PORT, _FoundError)
    except _FoundError as found:
        raise NonconformityError(f"{found}; {_on_the_emulator(rig, chance)}") from None


def _on_the_emulator(rig: Rig, chance: int) -> str:
    """Return the result of the same walks on the emulator."""
    try:
        port = open_port(_STAND_IN_URL, rig.profile)
    except SessionError:
        return "not shrunk: the emulator is not installed"
    stand = stand_beside(port, None, rig.profile)
    twin = Rig(Wire(RecordedPort(port), rig.profile.byte_s), rig.profile, stand, 0, Random(0))  # noqa: S311  # not used
    try:
        _search_and_shrink(twin, chance, ON_A_PORT)
    except NonconformityError as error:
        return f"the emulator fails too: {error}"
    finally:
        port.close()
    return "the emulator passes the same walk"


def _search_and_shrink(rig: Rig, chance: int, size: tuple[int, int]) -> None:
    """Raise the shortest failing walk. A table that fails only sometimes gives the shortest failure that occurred."""
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
    """Run the given number of walks and steps, drawn from a seed. Raise the first `failure`, or shrink it before."""
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
