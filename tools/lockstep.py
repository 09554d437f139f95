"""Is the compiled firmware the emulator's? Both at the same plant, under the same random client, tick for tick.

A client sends commands that pre-empt each other, numbers at all limits, and nonsense; the trigger falls, the load
changes, the power fails. After each tick the duty on both bridges must be the same, and in the end all replies.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from random import Random
from tempfile import TemporaryDirectory
from types import MappingProxyType

from emulator.avr.chip import Chip
from emulator.avr.compiled_table import CompiledTable
from emulator.avr.header import CLOCK_HZ, MOST_EDGES_S
from emulator.config.table_config import TableConfig, load_config
from emulator.table.table import Table

TABLES: Mapping[str, str] = MappingProxyType(
    {
        "default": "",
        "other gears and gains": """
            gears = { ratio = "2197/27", efficiency = 0.8, backlash_arcmin = 20.0 }
            encoder = { lines = 500 }
            driver = { pwm_bits = 9 }
            limits = { speed_deg_s = 33.3, acceleration_deg_s2 = 120.5 }
            serial = { decimals = 3 }
            [gains]
            ramp = { proportional_duty_s_deg = 0.003, integral_time_s = 0.01, derivative_time_s = 0.001 }
            hold = { proportional_duty_s_deg = 0.004, integral_time_s = 0.02, derivative_time_s = 0.0005 }
        """,
        "other tick": """
            control = { tick_hz = 500, speed_window_ticks = 5 }
            serial = { decimals = 2, baud = 19200 }
            gears = { ratio = 498.9 }
            limits = { speed_deg_s = 25.0, acceleration_deg_s2 = 60.0 }
        """,
    }
)
"""The tables that both are compared at, as the keys of a configuration that differ from the default one."""

_NONSENSE = (
    b"Q",
    b"P 1e5",
    b"\x18",
    b"P" + b" " * 40,
    b"",
    b"h",
    b"S 0",
    b"A -1",
    b"R 1.",
    b"P 4194304",
    b"\xff 3",
    b"H1",
)
_QUIET_TICKS = (1, 4, 20, 60, 200, 600, 2500)
_LOADS_NM = (0.0, 0.0, 0.2, -0.2, 3.0)
_LINES_AT_ONCE = (1, 1, 1, 2)
"""The replies to more of them could fill the transmit buffer, which the two empty up to a tick apart."""
_SHORT_LINE = 4
"""Bytes. Where a tick carries more, two lines may arrive in one; the second may then take effect a tick later."""
_BEFORE_CARRY = 253
"""Edges after which one more changes both bytes of the counter, which begins at the phase 2 of the encoder."""
_CYCLES_ABOUT_A_TICK = 420


class PartingError(Exception):
    """Firmware and emulator differ. The message states the time and the difference."""


@dataclass
class Lockstep:
    """What two tables did together.

    Attributes:
        ticks: that were compared.
        lines: that both answered alike.
        motions: motion commands among them.
        longest_tick: cycles of the longest tick of the firmware.
    """

    ticks: int = 0
    lines: int = 0
    motions: int = 0
    longest_tick: int = 0


def configured(name: str) -> TableConfig:
    """Return one of the `TABLES`."""
    with TemporaryDirectory() as folder:
        file = Path(folder) / "table.toml"
        file.write_text("\n".join(line.strip() for line in TABLES[name].splitlines()), encoding="utf-8")
        return load_config(file)


class Pair:
    """The emulator and the compiled firmware, which get the same and must do the same."""

    def __init__(self, config: TableConfig, seed: int, firmware: Path | None = None) -> None:
        """Switch both on."""
        self.emulated = Table(config, seed)
        self.compiled = CompiledTable(config, seed, firmware)
        self.sent: list[bytes] = []

    @property
    def is_quiet(self) -> bool:
        """Whether nothing is on either line."""
        return self.emulated.ticks_until_byte() is None and self.compiled.ticks_until_byte() is None

    def send(self, line: bytes) -> None:
        """Send a line, without its CR, to both."""
        self.sent.append(line)
        for table in (self.emulated, self.compiled):
            table.receive(line + b"\r")

    def trigger(self) -> None:
        """Put an edge on the trigger of both, between two ticks."""
        self.emulated.trigger()
        self.compiled.trigger()

    def step(self, ticks: int = 1) -> None:
        """Let ticks pass, one by one.

        Raises:
            PartingError: the duties on the bridges are not the same.
        """
        for _ in range(ticks):
            self.emulated.advance(1)
            self.compiled.advance(1)
            if self.emulated.duty != self.compiled.duty:
                raise PartingError(
                    f"at tick {self.emulated.tick} the emulator's duty is {self.emulated.duty}, the firmware's "
                    f"{self.compiled.duty}, after {self.sent[-3:]}"
                )

    def compare(self) -> None:
        """Compare all replies since the last call, once both lines are quiet, and what is in both memories.

        Raises:
            PartingError: they are not the same.
        """
        ours, theirs = self.emulated.transmit(), self.compiled.transmit()
        if ours != theirs:
            raise PartingError(f"the emulator answers {ours[:80]!r}, the firmware {theirs[:80]!r}, to {self.sent[-3:]}")
        ours_seen, theirs_seen = self.emulated.status(), self.compiled.status()
        for name, ours_value in ours_seen._asdict().items():
            if (theirs_value := getattr(theirs_seen, name)) != ours_value:
                raise PartingError(f"{name} is {ours_value} at the emulator and {theirs_value} at the firmware")
        chip, overruns = self.compiled.chip, self.compiled.overruns
        if chip.lost_edges or overruns or chip.duty_changes:
            raise PartingError(
                f"the firmware lost {chip.lost_edges} edges and {overruns} ticks, and changed the duty amid "
                f"{chip.duty_changes} ticks"
            )


def run_lockstep(config: TableConfig, ticks: int, seed: int, firmware: Path | None = None) -> Lockstep:
    """Run both under a random client, and return what they did.

    Raises:
        PartingError: they did not do the same.
    """
    chance = Random(seed)  # noqa: S311  # no secret
    pair, done = Pair(config, seed, firmware), Lockstep()
    is_fast_line = config.serial.baud > 10 * _SHORT_LINE * config.control.tick_hz
    while done.ticks < ticks:
        _disturb(pair, chance)
        for _ in range(1 if is_fast_line else chance.choice(_LINES_AT_ONCE)):
            line = random_line(chance, config)
            pair.send(line)
            done.lines += 1
            done.motions += line[:1] in {b"P", b"R"}
        quiet = min(chance.choice(_QUIET_TICKS), max(1, ticks - done.ticks))
        begun = pair.emulated.tick
        pair.step(quiet)
        while not pair.is_quiet:
            pair.step()
        pair.compare()
        done.ticks += pair.emulated.tick - begun
        done.longest_tick = max(done.longest_tick, pair.compiled.chip.longest_tick)  # a power cycle resets it
    return done


def _disturb(pair: Pair, chance: Random) -> None:
    """Now and then let something come that is not on the line."""
    if chance.random() < 0.2:
        pair.trigger()
    if chance.random() < 0.05:
        load_Nm = chance.choice(_LOADS_NM)
        pair.emulated.set_load_torque(load_Nm)
        pair.compiled.set_load_torque(load_Nm)
    if chance.random() < 0.01:
        count = chance.choice((0, 0, 2**31 - 3000, -(2**31) + 3000))
        pair.emulated.reset(count)
        pair.compiled.reset(count)


def random_line(chance: Random, config: TableConfig) -> bytes:
    """Return a command of the protocol, or nonsense."""
    limits, digits = config.limits, chance.randint(0, 6)
    verb = chance.choice("PPRRRSSAAHL?")
    if verb == "?":
        return chance.choice(_NONSENSE)
    if verb in "HL":
        return verb.encode()
    scale = {"P": 300.0, "R": 40.0, "S": 1.1 * limits.speed_deg_s, "A": 1.1 * limits.acceleration_deg_s2}[verb]
    if verb in "SA" and chance.random() < 0.4:
        return f"{verb} {scale / 1.1:.1f}".encode()
    value = scale * chance.choice((1.0, 1.0, 0.05, 0.0005)) * chance.random()
    sign = chance.choice(("", "", "+", "-")) if verb in "PR" else ""
    return f"{verb}{' ' * chance.randint(0, 2)}{sign}{value:.{digits}f}".encode()


def run_edges(config: TableConfig, ticks: int, edges_s: int = MOST_EDGES_S, firmware: Path | None = None) -> Chip:
    """Turn the shaft at a constant speed both ways, and return the controller, which moves, brakes and answers lines.

    The edges come at any cycle of a tick, also while it is sampled.

    Raises:
        PartingError: its count is not that of the edges.
    """
    table = CompiledTable(config, 0, firmware)
    chip, per_tick = table.chip, edges_s / config.control.tick_hz
    chip.unguard()
    commands = b"".join(b"S %g\rA %g\rP %d\rH\rL\r" % (*_limits(config), angle) for angle in (9, -9, 90, -5, 1))
    place = counted = sent = 0.0
    for tick in range(ticks):
        direction = 1 if tick < ticks // 2 else -1
        end = place + direction * per_tick
        edges = math.floor(end) - math.floor(place)
        # As many bytes as the line carries in a tick: more than it carries replies to, so that all rings are full.
        due = int((tick + 1) * config.serial.baud / 10 / config.control.tick_hz) - int(sent)
        arriving = bytes(commands[(int(sent) + k) % len(commands)] for k in range(due))
        chip.tick(place, direction * per_tick, end, edges, arriving, (0.5,) if tick % 7 == 0 else ())
        place, sent, counted = end, sent + due, counted + edges
        chip.take_sent()
        _check_count(chip, counted, most=2)  # of edges that come while the tick is sampled
    chip.tick(place, 0.0, place, 0)
    _check_count(chip, counted, most=0)
    if chip.lost_edges:
        raise PartingError(f"the firmware lost {chip.lost_edges} edges")
    return chip


def run_phases(config: TableConfig, firmware: Path | None = None) -> None:
    """Let an edge that changes both bytes of the 16-bit counter fall on each cycle about a tick.

    Raises:
        PartingError: the tick's sample is torn.
    """
    chip = CompiledTable(config, 0, firmware).chip
    chip.unguard()
    place = 0.5
    for _ in range(_BEFORE_CARRY):
        chip.tick(place, 1.0, place + 1.0, 1)
        place += 1.0
    tick_cycles = CLOCK_HZ // config.control.tick_hz
    for cycle in range(tick_cycles - _CYCLES_ABOUT_A_TICK, tick_cycles):
        share = cycle / tick_cycles
        chip.tick(place, 0.5 / share, place + 0.5 / share, 1)  # at this share the shaft is at the edge
        _check_count(chip, place + 0.5, most=1)
        chip.tick(place + 1.0, -1.0, place, -1)


def _check_count(chip: Chip, counted: float, most: int) -> None:
    count = chip.number("encoder_position", "<i")
    if abs(count - math.floor(counted)) > most:
        raise PartingError(f"the firmware counts {count} of {math.floor(counted)} edges")


def _limits(config: TableConfig) -> tuple[float, float]:
    return config.limits.speed_deg_s, config.limits.acceleration_deg_s2
