"""What can be done to the table besides talking to it: trigger it, switch it off and on, preset its counter.

Who stands behind the port decides which of these there are: a table in the same process (the port has a `table`), the
control channel of an emulator, programs that the profile names, or nobody.
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
DISCONNECT = "a table that sees its client go"
PACING = "a paced line"
RANDOM_SEARCH = "the library hypothesis"

_PROGRAM_S = 60.0
_TRIGGER_KEY = "rig.trigger_command"
_POWER_CYCLE_KEY = "rig.power_cycle_command"


class Stand:
    """What the rig can do beside the wire, here nothing; calling what is not among the capabilities is an error.

    Attributes:
        capabilities: what there is.
        facts: the table's constants, where it can be asked for them.
    """

    capabilities: frozenset[str] = frozenset()
    facts: TableFacts | None = None

    def trigger(self) -> None:
        """Put one edge on the trigger input, now."""
        raise BenchError("the rig has no way to trigger the table")

    def power_cycle(self) -> None:
        """Switch the table off and on."""
        raise BenchError("the rig has no way to switch the table off")

    def preset(self, count: int) -> None:
        """Switch the table off and on, with its counter at `count`."""
        raise BenchError(f"the rig has no way to preset the counter to {count}")

    def encoder_deg(self) -> float:
        """Return the encoder's position now, as it is inside the table."""
        raise BenchError("the rig does not see the encoder")

    def trigger_within(self, share: float) -> float:
        """Put an edge at a share (0..1) of the table's coming tick, and return the encoder's position at the edge."""
        raise BenchError(f"the rig cannot trigger the table at {share:g} of a tick")


class OnBench(Stand):
    """A table with a bench, which does what it is told."""

    capabilities = frozenset({TRIGGER, POWER_CYCLE, PRESET})

    def __init__(self, bench: Bench) -> None:
        self.facts = bench.facts
        self._bench = bench

    def trigger(self) -> None:
        """Put one edge on the trigger input, now."""
        self._bench.trigger()

    def power_cycle(self) -> None:
        """Switch the table off and on."""
        self._bench.reset()

    def preset(self, count: int) -> None:
        """Switch the table off and on, with its counter at `count`."""
        self._bench.reset(count)


class InProcess(OnBench):
    """A simulated table behind a port of this process, whose time stands while it is looked at."""

    capabilities = OnBench.capabilities | {OBSERVER}

    def __init__(self, table: SimulatedBench) -> None:
        super().__init__(table)
        self._table = table

    def encoder_deg(self) -> float:
        """Return the encoder's position now."""
        return self._table.status().encoder_deg

    def trigger_within(self, share: float) -> float:
        """Put an edge at a share (0..1) of the coming tick, and return the encoder's position at the edge."""
        before_deg = self.encoder_deg()
        self._table.trigger(share)
        if share:
            self._table.advance(1)
        return before_deg + share * (self.encoder_deg() - before_deg)


class Programs(Stand):
    """Programs of the test bench that the profile names; each has done its deed when it ends with status 0.

    Raises:
        BenchError: there is no such program here.
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
                raise BenchError(f"{key}: there is no program {command[0]!r} here; give its path, or leave the key out")

    def trigger(self) -> None:
        """Run the trigger's program."""
        self._run(_TRIGGER_KEY, self._trigger_command)

    def power_cycle(self) -> None:
        """Run the power switch's program."""
        self._run(_POWER_CYCLE_KEY, self._power_cycle_command)

    def _run(self, key: str, command: Sequence[str]) -> None:
        if not command:
            raise BenchError(f"the profile has no {key}")
        failure = failure_of(command, self._timeout_s)
        if failure:
            raise BenchError(f"the profile's {key}, `{shlex.join(command)}`, {failure}")


class RecordedStand(Stand):
    """Another stand, whose deeds stand in the record of the wire."""

    def __init__(self, stand: Stand, note: Callable[[str], None]) -> None:
        self.capabilities, self.facts = stand.capabilities, stand.facts
        self._stand = stand
        self._note = note

    def trigger(self) -> None:
        """Put one edge on the trigger input, now."""
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
        """Return the encoder's position now, which is not recorded."""
        return self._stand.encoder_deg()

    def trigger_within(self, share: float) -> float:
        """Put an edge at a share (0..1) of the coming tick, and return the encoder's position at the edge."""
        self._note("trigger")
        return self._stand.trigger_within(share)


def stand_beside(port: Port, control: Path | None, profile: Profile) -> Stand:
    """Return what can be done to the table at a port.

    Raises:
        BenchError: the control channel does not answer, or a program that the profile names is not there.
    """
    if control is not None:
        return OnBench(ControlChannel(control))
    table = bench_of(port)
    if table is not None:
        return InProcess(table)
    return Programs(profile.rig.trigger_command, profile.rig.power_cycle_command)


def profile_of_the_table(stand: Stand, profile: Profile) -> Profile:
    """Return the profile with what the rig can ask the table itself: how many counts its registers have to a degree."""
    if stand.facts is None:
        return profile
    return replace(profile, table=replace(profile.table, counts_per_deg=stand.facts.counts_per_deg))


def capabilities(stand: Stand, profile: Profile) -> frozenset[str]:
    """Return all that cases may need and that there is: of the rig, of the table, of this installation."""
    found = {ERROR_REPLIES if profile.serial.error_replies else STRICT}
    if profile.rig.sees_disconnect:
        found.add(DISCONNECT)
    if profile.serial.baud:
        found.add(PACING)
    if find_spec("hypothesis"):
        found.add(RANDOM_SEARCH)
    return stand.capabilities | found
