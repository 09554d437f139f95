"""The control channel: commands to a running emulator, separate from the serial line.

A request is one line of JSON, `{"command": NAME, PARAMETER: NUMBER, ...}`. Its reply is one line, `{"ok": true, ...}`
or `{"ok": false, "error": SENTENCE}`. `control` transmits them.
"""

import json
from collections.abc import Callable, Mapping
from typing import Any, NamedTuple, Protocol

from emulator.faults.fault import KINDS, FaultError, fault_from, help_of, parameters_of
from emulator.faults.parameter import Parameter
from emulator.server.clock import TIME_SCALE
from protocol.bench import Bench
from protocol.files.data_file import shown


class Stand(Protocol):
    """The target of commands: a table, and the running server, which has the clock."""

    @property
    def table(self) -> Bench:
        """The table. Only the server can trigger it at an exact instant."""
        ...

    @property
    def time_scale(self) -> float:
        """Simulated seconds per real second."""
        ...

    def trigger(self) -> None:
        """Latch the encoder now."""
        ...

    def set_time_scale(self, time_scale: float) -> None:
        """Change the time scale from now on."""
        ...

    def quit(self) -> None:
        """End the emulator when the present events are processed."""
        ...


class Command(NamedTuple):
    """One command of the control channel; `run` returns the fields of its reply without `ok`."""

    help: str
    parameters: tuple[Parameter, ...]
    run: Callable[[Stand, Mapping[str, float]], Mapping[str, Any] | None]


def _fault_command(kind: str) -> Command:
    """Return the command that injects a fault of this kind."""
    return Command(
        f"fault: {help_of(kind)}",
        parameters_of(kind),
        lambda stand, given: stand.table.inject(fault_from(kind, given)),
    )


COMMANDS: Mapping[str, Command] = {
    "trigger": Command("latch the encoder, as the probe's signal does", (), lambda stand, _: stand.trigger()),
    "state": Command(
        "show the state of the table: positions, speeds, motor, queues",
        (),
        lambda stand, _: {**stand.table.status()._asdict(), "time_scale": stand.time_scale},
    ),
    "facts": Command(
        "show the table's constants that its clients may rely on", (), lambda stand, _: stand.table.facts._asdict()
    ),
    "load-torque": Command(
        "apply a constant load torque",
        (
            Parameter(
                "torque_Nm", -1000.0, 1000.0, "torque at the table's axis in Nm; positive opposes forward rotation"
            ),
        ),
        lambda stand, given: stand.table.set_load_torque(given["torque_Nm"]),
    ),
    "time-scale": Command(
        "run faster or slower than real time",
        (TIME_SCALE,),
        lambda stand, given: stand.set_time_scale(given["time_scale"]),
    ),
    "reset": Command("cut the table's power and switch it on again", (), lambda stand, _: stand.table.reset()),
    "preset": Command(
        "reset the table, and start the counter at COUNT",
        (Parameter("count", -(2**31), 2**31 - 1, "initial value of the counter", whole=True),),
        lambda stand, given: stand.table.reset(int(given["count"])),
    ),
    "clear-faults": Command(
        "end all faults, and cancel the scheduled ones", (), lambda stand, _: stand.table.clear_faults()
    ),
    "quit": Command("end the emulator, as SIGTERM does", (), lambda stand, _: stand.quit()),
} | {f"fault-{kind}": _fault_command(kind) for kind in KINDS}
"""All commands, in one place. The server runs them, and the command-line client lists them."""


class RequestError(ValueError):
    """A request that cannot be executed. The message is the sentence of the reply."""


def answer(request: bytes, stand: Stand) -> bytes:
    """Execute one request and return its reply. An invalid request changes nothing."""
    try:
        command, given = _parse(request)
        result = command.run(stand, given) or {}
    except (RequestError, FaultError) as error:
        return refusal(str(error))
    return json.dumps({"ok": True, **result}).encode() + b"\n"


def _parse(request: bytes) -> tuple[Command, dict[str, float]]:
    fields = _parsed_line(request)
    if not isinstance(fields, dict) or not isinstance(name := fields.pop("command", None), str):
        raise RequestError('a request is a JSON object that names its command, such as {"command": "state"}')
    if name not in COMMANDS:
        raise RequestError(f"{shown(name)} is not a command; allowed are {', '.join(COMMANDS)}")
    command = COMMANDS[name]
    required = {parameter.name for parameter in command.parameters if not parameter.optional}
    if not required <= fields.keys() <= {parameter.name for parameter in command.parameters}:
        expected = [
            f"{parameter.name} (optional)" if parameter.optional else parameter.name for parameter in command.parameters
        ]
        raise RequestError(f"{name} takes {' and '.join(expected) or 'no parameter'}, and nothing else")
    return command, {
        parameter.name: _number(name, parameter, fields[parameter.name])
        for parameter in command.parameters
        if parameter.name in fields
    }


def _parsed_line(line: bytes) -> Any:  # noqa: ANN401  # any JSON value
    """Return the value of a line of JSON.

    Raises:
        RequestError: the line is not JSON, it is nested too deeply, or a name occurs twice in an object.
    """
    try:
        return json.loads(line, object_pairs_hook=_object)
    except RequestError:
        raise
    except (ValueError, RecursionError):
        raise RequestError('a request is one line of JSON, such as {"command": "state"}') from None


def _object(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    fields = dict(pairs)
    if len(fields) < len(pairs):
        raise RequestError("a request names each parameter once")
    return fields


def _number(command: str, parameter: Parameter, value: Any) -> float:  # noqa: ANN401  # from outside
    if parameter.accepts(value):
        return float(value)
    raise RequestError(f"{command}: {parameter.name} must be {parameter.allowed}, not {shown(value)}")


def refusal(sentence: str) -> bytes:
    """Return the reply to a request that is not executed."""
    return json.dumps({"ok": False, "error": sentence}).encode() + b"\n"
