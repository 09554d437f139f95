"""The table whose firmware is the compiled one: an ATmega328P in simavr in place of `emulator.firmware`.

It has the surface of `emulator.Table`, so that all ports, the trace and the conformance kit work on it. The plant is
the emulator's. Each of its ticks is one call into the simulator.
"""

import math
import random
import struct
from pathlib import Path
from typing import NamedTuple

from emulator.avr.chip import Chip
from emulator.avr.elf import ElfError, Program, read_program
from emulator.avr.errors import ChipError, ToolchainError
from emulator.avr.header import digest_of, uart_of
from emulator.avr.toolchain import build_firmware
from emulator.config.constants import drive_constants, encoder_constants
from emulator.config.table_config import TableConfig
from emulator.faults.fault import FaultError
from emulator.faults.schedule import FaultSchedule
from emulator.firmware.controller import STATE_NAMES
from emulator.firmware.fixed_point import from_fixed
from emulator.firmware.pid import RAMP
from emulator.line.uart import Wire
from emulator.plant.drive_train import at_standstill
from emulator.plant.drive_train import step as drive_step
from emulator.plant.encoder import recounted
from emulator.table.status import table_facts
from emulator.table.table import Table
from emulator.table.trigger import TriggerInput
from protocol.bench import Fault, Observer, TableStatus

_CONTROLLER = struct.Struct("<BiiBhiiqiIiqiIII")
"""`struct controller` of `firmware/controller.h`; the controller has no gaps between the fields of a structure."""
_DIGEST_BYTES = 16


class Controller(NamedTuple):
    """The controller's memory, field by field as in `firmware/controller.h`."""

    motion: int
    integral: int
    measured: int
    gain_set: int
    duty: int
    speed: int
    acceleration: int
    far: int
    position: int
    fraction: int
    reference_speed: int
    distance: int
    encoder_count: int
    still_ticks: int
    settling_ticks: int
    arrived_ticks: int


class CompiledTable:
    """A rotary table run by the compiled firmware, in simulated time.

    The same configuration, seed, bytes and ticks give the same bytes and states.

    Attributes:
        config: the table's constants, those that the firmware was built for.
        facts: the constants that its clients may use.
        tick: ticks since power-on.
        observer: called after every tick, if set.
        chip: the simulated controller.

    Raises:
        ConfigError: the controller cannot run such a table.
        ToolchainError: the firmware cannot be built or run on this machine, or is for another table.
        ChipError: it does not start, or sets up another PWM.
    """

    hung_up = False

    def __init__(self, config: TableConfig, seed: int = 0, firmware: Path | None = None) -> None:
        """Switch the table on, at rest at 0 degrees.

        Args:
            config: the table's constants; its faults are not taken.
            seed: places shaft and gear teeth, as in `emulator.Table`.
            firmware: an ELF file; without it the firmware is built for the table.
        """
        chance = random.Random(seed)  # noqa: S311  # not for security
        tick_hz = config.control.tick_hz
        self._refuse_faults(config.faults)
        self.config = config
        self.facts = table_facts(config)
        self.tick = 0
        self.observer: Observer | None = None
        self._train = drive_constants(config)
        self._encoder = encoder_constants(config, chance.random())
        self._drive = at_standstill(self._train, gap_share=chance.uniform(-1.0, 1.0))
        self._volts_per_duty = config.driver.supply_V / config.driver.duty_max
        self._program = read_firmware(config, firmware)
        self._bit_cycles = uart_of(config.serial.baud).cycles_per_bit
        self._incoming = Wire(config.serial.baud, tick_hz)
        self._triggers = TriggerInput(tick_hz, FaultSchedule((), tick_hz, seed, frozenset()))
        self._load_torque_Nm = 0.0
        self._true_zero_rad = 0.0
        self._sent = self._heard = self._said = b""
        self._switch_on(0)

    def receive(self, data: bytes) -> None:
        """Take bytes that the client sends now."""
        self._incoming.queue.extend(data)

    def transmit(self) -> bytes:
        """Return and remove the bytes that have been sent by now."""
        sent, self._sent = self._sent, b""
        return sent

    @property
    def duty(self) -> int:
        """The duty on the bridge in the coming tick, in PWM steps; below 0 it drives backwards."""
        return self.chip.duty

    @property
    def received_queue(self) -> int:
        """Bytes in transmission to the firmware."""
        head, tail, _, _ = self._ring_indices()
        return len(self._incoming.queue) + (head - tail) % 256

    @property
    def outgoing(self) -> bytes:
        """Bytes of replies that have not left yet: what the firmware holds back is not visible from outside."""
        return b""

    def ticks_until_byte(self) -> int | None:
        """Return ticks after which there may be a byte more in either direction; None while the line is idle."""
        head, tail, queued, left = self._ring_indices()
        if head != tail or queued != left or self.chip.is_sending:
            return 1
        return self._incoming.ticks_until_byte() if self._incoming.queue else None

    def ticks_until_sent(self, wanted: int) -> int | None:  # noqa: ARG002  # what is on its way is not visible
        """Return ticks after which bytes may have left; None while the line is idle."""
        return self.ticks_until_byte()

    def disconnect(self) -> None:
        """Let the client go: it gets no more of its replies. The firmware sees nothing of it, as on a real line."""
        self._sent = b""

    def inject(self, fault: Fault) -> None:
        """Refuse a fault: they are those of the emulator's firmware and line."""
        self._refuse_faults((fault,))

    def clear_faults(self) -> None:
        """Do nothing: there are none."""

    @property
    def trigger_hz(self) -> float:
        """The rate of the periodic trigger; 0 turns it off."""
        return self._triggers.rate_hz

    @trigger_hz.setter
    def trigger_hz(self, rate_hz: float) -> None:
        self._triggers.start_train(rate_hz, self.tick)

    def trigger(self, fraction: float = 0.0) -> None:
        """Put an edge on the trigger input, at a fraction (0..1) of the coming tick; the latch follows it."""
        if not 0.0 <= fraction < 1.0:
            raise ValueError(f"an edge at {fraction} of a tick is outside 0..1")
        if fraction == 0.0:
            self.chip.trigger()
        else:
            self._triggers.add_edge(self.tick, fraction)

    def set_load_torque(self, torque_Nm: float) -> None:
        """Apply a load torque that opposes positive rotation, until the next call."""
        if not math.isfinite(torque_Nm):
            raise ValueError(f"a load torque of {torque_Nm} Nm is not finite")
        self._load_torque_Nm, self._resting = float(torque_Nm), False

    def reset(self, count: int = 0) -> None:
        """Switch the table off and on. The controller starts at `count`, and the plant continues.

        A count other than 0 is written by a debugger that halts at main(); a controller of its own begins at 0.
        """
        self._encoder = recounted(self._encoder, self._drive.angle_rad, count)
        self._true_zero_rad = (self._drive.angle_rad - count / self._encoder.count_rad) * self._train.table_per_motor
        self._incoming.clear()
        self._sent = b""
        self._switch_on(count)

    def advance(self, ticks: int) -> None:
        """Advance the simulated time."""
        if ticks < 0:
            raise ValueError(f"time cannot go back by {-ticks} ticks")
        end = self.tick + ticks
        while self.tick < end:
            quiet = 0 if not self._resting or self._incoming.queue or self.observer else self._quiet_ticks(end)
            if quiet > 0:
                self.tick += self.chip.idle(quiet)
                self._resting = self.chip.duty == 0
            else:
                self._advance_one()
            if sent := self.chip.take_sent():
                self._sent += sent
                self._said += sent
            if self.observer is not None:
                self.observer(self.status(), self._heard, self._said)
            self._heard = self._said = b""

    def controller(self) -> Controller:
        """Return the controller's memory at the end of its present tick."""
        self.chip.settle()
        return Controller(*_CONTROLLER.unpack(self.chip.memory("controller", _CONTROLLER.size)))

    def status(self) -> TableStatus:
        """Return what can be seen of the table now: plant and pins, and what a debugger reads."""
        config, now, drive = self.config, self.controller(), self._drive
        count_deg, bits = config.counts_per_deg, config.motion_bits
        speed_deg_s = config.control.tick_hz / count_deg  # speed of one count per tick
        head, tail, queued, left = self._ring_indices()
        return TableStatus(
            tick=self.tick,
            reference_deg=(now.position + from_fixed(now.fraction, bits)) / count_deg,
            encoder_deg=now.encoder_count / count_deg,
            true_deg=math.degrees(drive.table_angle_rad - self._true_zero_rad),
            reference_speed_deg_s=from_fixed(now.reference_speed, bits) * speed_deg_s,
            speed_deg_s=now.measured / config.control.speed_window_ticks * speed_deg_s,
            true_speed_deg_s=math.degrees(drive.table_speed_rad_s),
            current_A=drive.current_A,
            duty=now.duty / config.driver.duty_max,
            gain_set="ramp" if now.gain_set == RAMP else "hold",
            state=STATE_NAMES[now.motion],
            latched_deg=self.chip.number("latched_count", "<i") / count_deg,
            received_queue=len(self._incoming.queue) + (head - tail) % 256,
            transmit_queue=(queued - left) % 256,
            lost_bytes=self.chip.number("lost_bytes", "<H"),
            load_torque_Nm=self._load_torque_Nm,
            shaft_deg=(drive.angle_rad * self._encoder.count_rad + self._encoder.phase - 0.5) / count_deg,
            gap_deg=math.degrees(drive.angle_rad / config.gears.ratio - drive.table_angle_rad),
        )

    @property
    def overruns(self) -> int:
        """Ticks that came before the one before was over."""
        return self.chip.number("overruns", "<H")

    def _switch_on(self, count: int) -> None:
        self.chip = Chip(self._program, self.config.control.tick_hz, self._bit_cycles, count)
        if self.chip.pwm_steps != self.config.driver.duty_max:
            raise ChipError(f"its PWM has {self.chip.pwm_steps} steps instead of {self.config.driver.duty_max}")
        self._resting = False

    def _quiet_ticks(self, end: int) -> int:
        """Return the ticks until something comes from outside, `end` at the latest."""
        edge = self._triggers.next_tick
        return (end if edge is None else min(end, edge)) - self.tick

    def _advance_one(self) -> None:
        """Let the plant go through one tick, and the firmware with it."""
        before, duty, encoder = self._drive, self.chip.duty, self._encoder
        after = drive_step(self._train, before, duty * self._volts_per_duty, self._load_torque_Nm)
        start = before.angle_rad * encoder.count_rad + encoder.phase
        end = after.angle_rad * encoder.count_rad + encoder.phase
        straight = before.speed_rad_s * self._train.tick_s * encoder.count_rad
        arriving = bytes(self._incoming.advance())
        edges = math.floor(end) - math.floor(start)
        self.chip.tick(start, straight, end, edges, arriving, self._trigger_shares())
        self._drive, self._resting = after, after == before and duty == 0 and self.chip.duty == 0
        self.tick += 1
        self._heard += arriving

    def _trigger_shares(self) -> list[float]:
        shares = []
        while (share := self._triggers.take(self.tick)) is not None:
            shares.append(share)
        return shares

    def _ring_indices(self) -> tuple[int, int, int, int]:
        """Return head and tail of the firmware's receive ring, then of its transmit ring."""
        names = ("receive_head", "receive_tail", "transmit_head", "transmit_tail")
        head, tail, queued, left = (self.chip.memory(name, 1)[0] for name in names)
        return head, tail, queued, left

    @staticmethod
    def _refuse_faults(faults: tuple[Fault, ...]) -> None:
        if faults:
            raise FaultError(
                f"{faults[0].kind} has no effect on the compiled firmware; inject faults into the emulator's own"
            )


AnyTable = Table | CompiledTable
"""A table in simulated time, whichever firmware it has."""


def read_firmware(config: TableConfig, file: Path | None) -> Program:
    """Return the firmware in a file, or else one that is built for a configured table.

    Raises:
        ToolchainError: the file cannot be read, or is not for this table; or the firmware cannot be built.
    """
    path = build_firmware(config) if file is None else file
    try:
        program = read_program(path.read_bytes())
        address = program.symbols["table_digest"]
    except OSError as error:
        raise ToolchainError(f"{path}: {error.strerror}; name the .elf file of a firmware") from error
    except (ElfError, KeyError) as error:
        raise ToolchainError(f"{path}: is not this firmware: {error}; build it with `make firmware`") from error
    wanted, found = digest_of(config).encode(), program.flash[address : address + _DIGEST_BYTES]
    if found != wanted:
        raise ToolchainError(f"{path}: was built for another table; build it with `make firmware CONFIG=FILE`")
    return program
