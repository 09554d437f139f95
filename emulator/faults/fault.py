"""What can go wrong with a table: the faults by name, and when each strikes.

The same names and numbers are used in a configuration file, on the control channel and by `Table.inject`. When a fault
holds is in `fault_schedule`; what it does is in `line_faults`, `drive_faults` and `trigger_faults`.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import NamedTuple

from emulator.faults.parameter import Parameter, brief


class FaultError(ValueError):
    """A fault that cannot be; the message says what is allowed."""


class FaultKind(NamedTuple):
    """One kind of fault; one that strikes once does so at the next occasion, and is over."""

    help: str
    parameters: tuple[Parameter, ...] = ()
    strikes_once: bool = False


_PROBABILITY = Parameter("probability", 0.0, 1.0, "of each byte")
_DIRECTION = Parameter(
    "direction", -1, 1, "1: towards the table, -1: towards the client, 0 (default): both", optional=True, whole=True
)

KINDS: Mapping[str, FaultKind] = {
    "drop": FaultKind("bytes are lost on the line", (_PROBABILITY, _DIRECTION)),
    "flip": FaultKind("a bit of a byte turns over on the line", (_PROBABILITY, _DIRECTION)),
    "delay": FaultKind("all replies come later", (Parameter("seconds", 0.0, 3600.0, "by how long"),)),
    "half-reply": FaultKind(
        "the next reply ends before its end",
        (Parameter("bytes", 0, 32, "that are sent of it", whole=True),),
        strikes_once=True,
    ),
    "late-reply": FaultKind(
        "the next reply comes late, and those after it behind it",
        (Parameter("seconds", 0.0, 3600.0, "by how long"),),
        strikes_once=True,
    ),
    "silence": FaultKind("the table carries out what it hears and says nothing"),
    "hang-up": FaultKind("the port goes away; it comes back when the fault ends"),
    "wrong-baud": FaultKind(
        "the table listens and talks at another rate", (Parameter("baud", 50, 4_000_000, "of it", whole=True),)
    ),
    "stall": FaultKind("something holds the table"),
    "extra-load": FaultKind(
        "a torque loads the table",
        (Parameter("torque_Nm", -1000.0, 1000.0, "at its axis; positive resists forward rotation"),),
    ),
    "supply-sag": FaultKind("the motor's supply falls", (Parameter("supply_V", 0.0, 100.0, "that is left"),)),
    "stuck-pwm": FaultKind("the bridge keeps one duty", (Parameter("duty", -1.0, 1.0, "that it keeps"),)),
    "one-sided": FaultKind(
        "the bridge drives in one direction only",
        (Parameter("direction", -1, 1, "1: forwards, -1: backwards, 0: neither", whole=True),),
    ),
    "lost-counts": FaultKind("encoder edges are not counted", (_PROBABILITY._replace(help="of each edge"),)),
    "swapped-encoder": FaultKind("the encoder's A and B are swapped: it counts the wrong way"),
    "dead-encoder": FaultKind("the encoder counts nothing"),
    "missed-trigger": FaultKind("trigger edges are not seen", (_PROBABILITY._replace(help="of each edge"),)),
    "bounced-trigger": FaultKind(
        "each trigger edge is followed by others",
        (
            Parameter("edges", 1, 100, "that follow", whole=True),
            Parameter("within_s", 0.001, 10.0, "after it, spread by chance"),
        ),
    ),
}
"""Every fault by its name."""

SCHEDULE: tuple[Parameter, ...] = (
    Parameter("at_s", 0.0, 1e9, "begins at this time since the table was switched on (default: now)", optional=True),
    Parameter(
        "at_command",
        1,
        1e9,
        "begins with this command, counted from the first ever (default: now)",
        optional=True,
        whole=True,
    ),
    Parameter("for_s", 0.001, 1e9, "lasts so long (default: until it is cleared)", optional=True),
)
"""What every fault takes besides its own numbers."""


@dataclass(frozen=True)
class Fault:
    """A fault with its numbers, and when it begins and ends; see `fault_from`."""

    kind: str
    values: tuple[tuple[str, float], ...] = ()
    at_s: float | None = None
    at_command: int | None = None
    for_s: float | None = None

    def value(self, name: str) -> float:
        """Return one of its numbers; an optional one that was left out is 0."""
        return dict(self.values).get(name, 0.0)


def parameters_of(kind: str) -> tuple[Parameter, ...]:
    """Return all that a fault takes: its own numbers, and its schedule; one that strikes once has no duration."""
    own, once = KINDS[kind].parameters, KINDS[kind].strikes_once
    return own + tuple(parameter for parameter in SCHEDULE if not (once and parameter.name == "for_s"))


def fault_from(kind: object, given: Mapping[str, object]) -> Fault:
    """Return the fault of a name and its numbers.

    Raises:
        FaultError: there is no such fault, a number is missing, unknown or out of its range, or it has two beginnings.
    """
    if not isinstance(kind, str) or kind not in KINDS:
        raise FaultError(f"{brief(kind)} is not a fault; there are {', '.join(KINDS)}")
    _check_numbers(kind, given)
    numbers = {name: float(value) for name, value in given.items() if isinstance(value, int | float)}
    own = (parameter.name for parameter in KINDS[kind].parameters)
    at_command = numbers.get("at_command")
    return Fault(
        kind,
        tuple((name, numbers[name]) for name in own if name in numbers),
        numbers.get("at_s"),
        None if at_command is None else int(at_command),
        numbers.get("for_s"),
    )


def _check_numbers(kind: str, given: Mapping[str, object]) -> None:
    parameters = parameters_of(kind)
    unknown = sorted(set(given) - {parameter.name for parameter in parameters})
    if unknown:
        names = ", ".join(parameter.name for parameter in parameters)
        raise FaultError(f"{kind}: {unknown[0][:60]} is not known; it takes {names}")
    for parameter in parameters:
        if parameter.name not in given and not parameter.optional:
            raise FaultError(f"{kind}: {parameter.name} is missing; it must be {parameter.allowed}")
        if parameter.name in given and not parameter.accepts(given[parameter.name]):
            raise FaultError(
                f"{kind}: {parameter.name} is {brief(given[parameter.name])}; it must be {parameter.allowed}"
            )
    if "at_s" in given and "at_command" in given:
        raise FaultError(f"{kind}: at_s and at_command are two beginnings; give one of them")
