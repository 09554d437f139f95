"""Actions on the table without its serial line: trigger it, switch its power, preset its counter.

Which actions exist depends on what the port leads to: a table in this process (the port has a `table`), the control
channel of an emulator, programs that the profile names, or none of these.
"""

import shlex
from collections.abc import Callable, Sequence
from dataclasses import replace
from importlib.util import find_spec
from pathlib import Path
from shutil import which

from protocol.bench import Bench, BenchError, SimulatedBench, TableFacts, bench_of
from protocol.conformance.bench.program import failure_of
from protocol.conformance.profile.profile import Profile
from protocol.control_channel import ControlChannel
from protocol.port import Port

TRIGGER = "a trigger input that the rig can drive"
POWER_CYCLE = "a way to switch the table off and on"
PRESET = "a way to preset the position counter"
OBSERVER = "a view of the encoder beside the wire"
ERROR_REPLIES = "error replies"
STRICT = "strict Table 1 mode"
DISCONNECT = "a table that detects when its client disconnects"
PACING = "a paced line"
RANDOM_SEARCH = "the library hypothesis"

_PROGRAM_S = 60.0
_TRIGGER_KEY = "rig.trigger_command"
_POWER_CYCLE_KEY = "rig.power_cycle_command"


class Stand:
    """Actions of the rig, here none. Calling an action that is not among the capabilities is an error.

    Attributes:
        capabilities: the available actions.
        facts: the table's constants, if the rig can read them.
    """

    capabilities: frozenset[str] = frozenset()
    facts: TableFacts | None = None

    def trigger(self) -> None:
        """Apply one edge to the trigger input."""
        raise BenchError("the rig has no way to trigger the table")

    def power_cycle(self) -> None:
        """Switch the table off and on."""
        raise BenchError("the rig has no way to switch the table off")

    def preset(self, count: int) -> None:
        """Switch the table off and on, with its counter at `count`."""
        raise BenchError(f"the rig has no way to preset the counter to {count}")

    def encoder_deg(self) -> float:
        """Return the position of the encoder now, as the table has it."""
        raise BenchError("the rig does not see the encoder")

    def trigger_within(self, share: float) -> float:
        """Apply an edge at a fraction (0..1) of the coming tick, and return the encoder's position at the edge."""
        raise BenchError(f"the rig cannot trigger the table at {share:g} of a tick")


class OnBench(Stand):
    """A table with a bench."""

    capabilities = frozenset({TRIGGER, POWER_CYCLE, PRESET})

    def __init__(self, bench: Bench) -> None:
        self.facts = bench.facts
        self._bench = bench

    def trigger(self) -> None:
        """Apply one edge to the trigger input."""
        self._bench.trigger()

    def power_cycle(self) -> None:
        """Switch the table off and on."""
        self._bench.reset()

    def preset(self, count: int) -> None:
        """Switch the table off and on, with its counter at `count`."""
        self._bench.reset(count)


class InProcess(OnBench):
    """A simulated table behind a port of this process. Its time does not pass while it is observed."""

    capabilities = OnBench.capabilities | {OBSERVER}

    def __init__(self, table: SimulatedBench) -> None:
        super().__init__(table)
        self._table = table

    def encoder_deg(self) -> float:
        """Return the position of the encoder now."""
        return self._table.status().encoder_deg

    def trigger_within(self, share: float) -> float:
        """Apply an edge at a fraction (0..1) of the coming tick, and return the encoder's position at the edge."""
        before_deg = self.encoder_deg()
        self._table.trigger(share)
        if share:
            self._table.advance(1)
        return before_deg + share * (self.encoder_deg() - before_deg)


class Programs(Stand):
    """Programs of the test bench that the profile names. Status 0 means success.

    Raises:
        BenchError: a program was not found.
    """

    def __init__(
        self,
        trigger_command: Sequence[str],
        power_cycle_command: Sequence[str],
        timeout_s: float = _PROGRAM_S,
    ) -> None:
        self._trigger_command = trigger_command
        self._power_cycle_command = power_cycle_command
        self._timeout_s = timeout_s
        named = {TRIGGER: trigger_command, POWER_CYCLE: power_cycle_command}
        self.capabilities = frozenset(capability for capability, command in named.items() if command)
        for key, command in ((_TRIGGER_KEY, trigger_command), (_POWER_CYCLE_KEY, power_cycle_command)):
            if command and which(command[0]) is None:
                raise BenchError(f"{key}: program not found: {command[0]!r}; give its path, or remove the key")

    def trigger(self) -> None:
        """Run the program for the trigger."""
        self._run(_TRIGGER_KEY, self._trigger_command)

    def power_cycle(self) -> None:
        """Run the program for the power switch."""
        self._run(_POWER_CYCLE_KEY, self._power_cycle_command)

    def _run(self, key: str, command: Sequence[str]) -> None:
        if not command:
            raise BenchError(f"the profile has no {key}")
        failure = failure_of(command, self._timeout_s)
        if failure:
            raise BenchError(f"the profile's {key}, `{shlex.join(command)}`, {failure}")


class RecordedStand(Stand):
    """Wraps another stand and records its actions with the wire."""

    def __init__(self, stand: Stand, note: Callable[[str], None]) -> None:
        self.capabilities, self.facts = stand.capabilities, stand.facts
        self._stand = stand
        self._note = note

    def trigger(self) -> None:
        """Apply one edge to the trigger input."""
        self._note("trigger")
        self._stand.trigger()

    def power_cycle(self) -> None:
        """Switch the table off and on."""
        self._note("power_cycle")
        self._stand.power_cycle()

    def preset(self, count: int) -> None:
        """Switch the table off and on, with its counter at `count`."""
        self._note(f"preset {count}")
        self._stand.preset(count)

    def encoder_deg(self) -> float:
        """Return the position of the encoder now; this is not recorded."""
        return self._stand.encoder_deg()

    def trigger_within(self, share: float) -> float:
        """Apply an edge at a fraction (0..1) of the coming tick, and return the encoder's position at the edge."""
        self._note("trigger")
        return self._stand.trigger_within(share)


def stand_beside(port: Port, control: Path | None, profile: Profile) -> Stand:
    """Return the actions that are available for the table at a port.

    Raises:
        BenchError: the control channel does not reply, or a program that the profile names was not found.
    """
    if control is not None:
        return OnBench(ControlChannel(control))
    table = bench_of(port)
    if table is not None:
        return InProcess(table)
    return Programs(profile.rig.trigger_command, profile.rig.power_cycle_command)


def profile_of_the_table(stand: Stand, profile: Profile) -> Profile:
    """Return the profile with what the rig can read from the table: the counts per degree of its registers."""
    if stand.facts is None:
        return profile
    return replace(profile, table=replace(profile.table, counts_per_deg=stand.facts.counts_per_deg))


def capabilities(stand: Stand, profile: Profile) -> frozenset[str]:
    """Return all available capabilities: of the rig, of the table, of this installation."""
    found = {ERROR_REPLIES if profile.serial.error_replies else STRICT}
    if profile.rig.sees_disconnect:
        found.add(DISCONNECT)
    if profile.serial.baud:
        found.add(PACING)
    if find_spec("hypothesis"):
        found.add(RANDOM_SEARCH)
    return stand.capabilities | found
