"""The faults that can be injected into a table, with their names and their numbers.

The configuration file, the control channel and `Table.inject` use the same names and numbers. `schedule` defines when a
fault is active. `line_faults`, `drive_faults` and `trigger_faults` define its effect.
"""

from collections.abc import Mapping
from dataclasses import MISSING, fields
from typing import Annotated, Any, get_args, get_origin, get_type_hints

from emulator.faults.parameter import Parameter
from protocol.bench import Fault
from protocol.files.data_file import shown


class FaultError(ValueError):
    """A fault that cannot be injected. The message states what is allowed."""


ByteProbability = Annotated[float, 0.0, 1.0, "probability of each byte"]
EdgeProbability = Annotated[float, 0.0, 1.0, "probability of each edge"]
Delay = Annotated[float, 0.0, 3600.0, "delay in s"]
LineDirection = Annotated[int, -1, 1, "1: to the table, -1: to the client, 0 (default): both"]


class Drop(Fault, kind="drop"):
    """Bytes are lost on the line."""

    probability: ByteProbability
    direction: LineDirection = 0


class Flip(Fault, kind="flip"):
    """A bit of a byte is flipped on the line."""

    probability: ByteProbability
    direction: LineDirection = 0


class LateReplies(Fault, kind="delay"):
    """All replies are delayed."""

    seconds: Delay


class HalfReply(Fault, kind="half-reply"):
    """Truncate the next reply."""

    bytes: Annotated[int, 0, 32, "number of bytes that are sent"]


class LateReply(Fault, kind="late-reply"):
    """Delay the next reply; later replies queue behind it."""

    seconds: Delay


class Silence(Fault, kind="silence"):
    """Commands are executed without a reply."""


class HangUp(Fault, kind="hang-up"):
    """The port disappears; it comes back when the fault ends."""


class WrongBaud(Fault, kind="wrong-baud"):
    """The table receives and sends at another baud rate."""

    baud: Annotated[int, 50, 4_000_000, "baud rate"]


class Stall(Fault, kind="stall"):
    """The table is blocked."""


class ExtraLoad(Fault, kind="extra-load"):
    """A torque acts on the table."""

    torque_Nm: Annotated[float, -1000.0, 1000.0, "at its axis; positive resists forward rotation"]


class SupplySag(Fault, kind="supply-sag"):
    """The supply voltage drops."""

    supply_V: Annotated[float, 0.0, 100.0, "remaining voltage"]


class StuckPwm(Fault, kind="stuck-pwm"):
    """The bridge applies a constant duty."""

    duty: Annotated[float, -1.0, 1.0, "duty"]


class OneSided(Fault, kind="one-sided"):
    """The bridge drives in one direction only."""

    direction: Annotated[int, -1, 1, "1: forwards, -1: backwards, 0: neither"]


class LostCounts(Fault, kind="lost-counts"):
    """Encoder edges are not counted."""

    probability: EdgeProbability


class SwappedEncoder(Fault, kind="swapped-encoder"):
    """The encoder's A and B are swapped: it counts the wrong way."""


class DeadEncoder(Fault, kind="dead-encoder"):
    """The encoder does not count."""


class MissedTrigger(Fault, kind="missed-trigger"):
    """Trigger edges are lost."""

    probability: EdgeProbability


class BouncedTrigger(Fault, kind="bounced-trigger"):
    """Each trigger edge is followed by others."""

    edges: Annotated[int, 1, 100, "number of additional edges"]
    within_s: Annotated[float, 0.001, 10.0, "interval of the additional edges in s, at random times"]


STRIKES_ONCE = (HalfReply, LateReply)
"""These act once, at the next opportunity, and then end."""

KINDS: Mapping[str, type[Fault]] = {kind.kind: kind for kind in Fault.__subclasses__()}
"""Every fault of this file by its name."""


def help_of(kind: str) -> str:
    """Return the effect of a fault as a phrase."""
    sentence = KINDS[kind].__doc__ or kind
    return sentence[0].lower() + sentence[1:].rstrip(".")


def parameters_of(kind: str) -> tuple[Parameter, ...]:
    """Return all parameters of a fault: its own numbers, and its schedule. A fault that acts once has no duration."""
    own: list[Parameter] = []
    schedule: list[Parameter] = []
    defaults = {each.name: each.default for each in fields(KINDS[kind])}
    for name, hint in get_type_hints(KINDS[kind], include_extras=True).items():
        if get_origin(hint) is Annotated:
            number, least, most, words = get_args(hint)
            whole = int in (number, *get_args(number))
            parameter = Parameter(name, least, most, words, defaults[name] is not MISSING, whole)
            (schedule if name in Fault.__annotations__ else own).append(parameter)
    strikes_once = issubclass(KINDS[kind], STRIKES_ONCE)
    return (*own, *(parameter for parameter in schedule if not (strikes_once and parameter.name == "for_s")))


def fault_from(kind: object, given: Mapping[str, object]) -> Fault:
    """Return the fault with a name and its numbers.

    Raises:
        FaultError: the fault is unknown, a number is missing, unknown or out of range, or two start conditions are
            given.
    """
    if not isinstance(kind, str) or kind not in KINDS:
        raise FaultError(f"{shown(kind)} is not a fault; allowed are {', '.join(KINDS)}")
    _check_numbers(kind, given)
    whole = {parameter.name: parameter.whole for parameter in parameters_of(kind)}
    values: dict[str, Any] = {
        name: int(value) if whole[name] else float(value)
        for name, value in given.items()
        if isinstance(value, int | float)
    }
    return KINDS[kind](**values)


def _check_numbers(kind: str, given: Mapping[str, object]) -> None:
    parameters = parameters_of(kind)
    unknown = sorted(set(given) - {parameter.name for parameter in parameters})
    if unknown:
        names = ", ".join(parameter.name for parameter in parameters)
        raise FaultError(f"{kind}: {unknown[0][:60]} is not a parameter; allowed are {names}")
    for parameter in parameters:
        if parameter.name not in given and not parameter.optional:
            raise FaultError(f"{kind}: {parameter.name} is missing; it must be {parameter.allowed}")
        if parameter.name in given and not parameter.accepts(given[parameter.name]):
            raise FaultError(
                f"{kind}: {parameter.name} is {shown(given[parameter.name])}; it must be {parameter.allowed}"
            )
    if "at_s" in given and "at_command" in given:
        raise FaultError(f"{kind}: at_s and at_command are both given; give only one start condition")
