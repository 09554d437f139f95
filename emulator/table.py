"""The whole table in one object, without threads or clock: bytes in, bytes out, and ticks."""

import copy
import math
import random
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import NamedTuple

from emulator.config import TableConfig
from emulator.drive_train import DriveState, at_standstill
from emulator.encoder import angle_within_tick, count_at
from emulator.fault_effects import TO_CLIENT, TO_TABLE, Faults
from emulator.faults import Fault
from emulator.firmware import IDLE, STALLED, power_on
from emulator.fixed_point import wrap_int32
from emulator.interpreter import Interpreter, Registers
from emulator.profiler import Profile
from emulator.status import TableStatus, table_status
from emulator.tick import TableConstants, TableState, step, table_constants
from emulator.trigger import TriggerInput
from emulator.uart import LOST, Uart
from protocol.codec import decode_command, encode_reply
from protocol.line_buffer import LineBuffer
from protocol.messages import LINE_LIMIT, Command, ErrorCode, Refusal

_LONGEST_REPLY = LINE_LIMIT + 1

Observer = Callable[[TableStatus, bytes, bytes], None]
"""Called after each tick with the status, and the bytes that the firmware has read and that have left."""


class Snapshot(NamedTuple):
    """Everything that a table's future depends on, apart from its configuration."""

    tick: int
    constants: TableConstants
    state: TableState
    registers: Registers
    uart: Uart
    lines: LineBuffer
    triggers: TriggerInput
    replies: bytes
    faults: Faults
    load_torque_Nm: float
    true_zero_rad: float


class Table:
    """A rotary table: firmware and plant behind a serial line, in simulated time.

    The same configuration, seed, bytes and ticks give the same bytes and the same states to the last bit. The seed
    says where the shaft stands between two encoder edges, and the teeth in the backlash, at power-on.
    """

    def __init__(self, config: TableConfig, seed: int = 0) -> None:
        """Switch the table on, at rest at 0 degrees."""
        chance = random.Random(seed)  # noqa: S311  # where a gear stands is no secret
        self.config = config
        self.tick = 0
        self.observer: Observer | None = None
        self._interpreter = Interpreter(config)
        self._registers = self._interpreter.power_on()
        self._constants = table_constants(config, encoder_phase=chance.random())
        self._state = self._woken(at_standstill(self._constants.drive, gap_share=chance.uniform(-1.0, 1.0)))
        self._true_zero_rad = 0.0
        self._load_torque_Nm = 0.0
        self._uart = Uart(config.serial.baud, config.control.tick_hz)
        self._lines = LineBuffer()
        self._triggers = TriggerInput(config.control.tick_hz)
        self._replies = b""
        self._faults = Faults(config, seed)
        self._heard = self._said = b""  # in this tick, for the observer
        self._resting = False

    def receive(self, data: bytes) -> None:
        """Take bytes that the client puts on the line now."""
        if self._faults.present:
            data = self._faults.on_the_line(data, TO_TABLE)
        if self.config.serial.baud:
            self._uart.receive(data)
        else:
            self._interpret(data)

    def transmit(self) -> bytes:
        """Return the bytes that have left by now, and forget them."""
        sent, self._replies = self._replies, b""
        return sent

    def ticks_until_byte(self) -> int | None:
        """Return the ticks until the next byte in either direction is over; None while the line is idle."""
        ticks = self._uart.ticks_until_byte() if self.config.serial.baud else None
        held_until = self._faults.held_until
        if held_until is None:
            return ticks
        held = max(1, held_until - self.tick)
        return held if ticks is None else min(ticks, held)

    @property
    def hung_up(self) -> bool:
        """Whether a fault has taken the port away."""
        return self._faults.hangs_up

    def inject(self, fault: Fault) -> None:
        """Let something go wrong, now or when the fault says."""
        with self._faults_beginning():
            self._faults.inject(fault, self.tick)
        self._resting = False

    def clear_faults(self) -> None:
        """End all faults, and forget those to come; replies that are late are still to come."""
        self._faults.clear()

    def disconnect(self) -> None:
        """Let the client go: its half line and its unsent replies are forgotten, its motion goes on."""
        self._uart.disconnect()
        self._faults.disconnect()
        self._lines.discard()
        self._replies = b""

    def advance(self, ticks: int) -> None:
        """Let simulated time pass."""
        if ticks < 0:
            raise ValueError(f"time cannot go back by {-ticks} ticks")
        end = self.tick + ticks
        while self.tick < end:
            if not self._uart.idle or self.observer is not None or self._faults.turns_the_drive:
                self._advance_watched()
            else:
                event = self._next_event(end)
                if event <= self.tick:
                    self._advance_watched()
                else:
                    self._advance_undisturbed(event)
        if self._faults.present:
            self._serve_faults()

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
            self._see_edge(self._state.drive.angle_rad)
        else:
            self._triggers.add_edge(self.tick, fraction)

    def set_load_torque(self, torque_Nm: float) -> None:
        """Load the table with a torque that resists positive rotation, until it is set anew."""
        if not math.isfinite(torque_Nm):
            raise ValueError(f"a load torque of {torque_Nm} Nm is not finite")
        self._load_torque_Nm = torque_Nm
        self._resting = False

    def reset(self, count: int = 0) -> None:
        """Switch the table off and on: the controller wakes at `count` where the plant is; the plant goes on."""
        drive, encoder = self._state.drive, self._constants.encoder
        counted = math.floor(drive.angle_rad * encoder.count_rad + encoder.phase) - count
        self._constants = self._constants._replace(encoder=encoder._replace(phase=encoder.phase - counted))
        self._true_zero_rad = (drive.angle_rad - count / encoder.count_rad) * self._constants.drive.table_per_motor
        self.disconnect()
        self._registers = self._interpreter.power_on()._replace(latched_count=wrap_int32(count))
        self._state = self._woken(drive)
        self._resting = False

    def snapshot(self) -> Snapshot:
        """Return a copy of everything that the table's future depends on."""
        return copy.deepcopy(
            Snapshot(
                self.tick,
                self._constants,
                self._state,
                self._registers,
                self._uart,
                self._lines,
                self._triggers,
                self._replies,
                self._faults,
                self._load_torque_Nm,
                self._true_zero_rad,
            )
        )

    def restore(self, snapshot: Snapshot) -> None:
        """Go back to a snapshot of a table with this configuration."""
        (
            self.tick,
            self._constants,
            self._state,
            self._registers,
            self._uart,
            self._lines,
            self._triggers,
            self._replies,
            self._faults,
            self._load_torque_Nm,
            self._true_zero_rad,
        ) = copy.deepcopy(snapshot)
        self._resting = False

    def status(self) -> TableStatus:
        """Return what can be seen of the table now."""
        return table_status(
            self.config,
            self._state,
            self._uart,
            tick=self.tick,
            latched_count=self._registers.latched_count,
            load_torque_Nm=self._load_torque_Nm,
            true_zero_rad=self._true_zero_rad,
        )

    def _next_event(self, end: int) -> int:
        """Return the tick, `end` at the latest, at which an edge comes or a fault begins or ends."""
        edge, fault = self._triggers.next_tick, self._faults.next_tick
        if edge is not None and edge < end:
            end = edge
        return end if fault is None else min(end, fault)

    def _advance_undisturbed(self, end: int) -> None:
        """Pass ticks in which nothing comes from outside; a state that repeats itself stays to the end."""
        constants, torque_Nm, state = self._constants, self._load_torque_Nm, self._state
        for _ in range(end - self.tick):
            if self._resting:
                break
            before = state
            state = step(constants, before, torque_Nm)
            if state.firmware.motion in (IDLE, STALLED):
                self._resting = state == before
        self._state, self.tick = state, end

    def _advance_watched(self) -> None:
        """Pass one tick in which the line, an edge, a fault or the observer has its turn."""
        faults, before = self._faults, self._state
        if faults.present:
            self._serve_faults()
        if faults.turns_the_drive:
            self._constants, self._state = faults.step(self._constants, before, self._load_torque_Nm)
        else:
            self._state = step(self._constants, before, self._load_torque_Nm)
        self._resting = False
        while (fraction := self._triggers.take(self.tick)) is not None:
            drive, tick_s = before.drive, self._constants.drive.tick_s
            end_rad = self._state.drive.angle_rad
            self._see_edge(angle_within_tick(drive.angle_rad, end_rad, drive.speed_rad_s, tick_s, fraction))
        self.tick += 1
        if not self._uart.idle:
            self._serve_line()
        if self.observer is not None:
            heard, said, self._heard, self._said = self._heard, self._said, b"", b""
            self.observer(self.status(), heard, said)

    def _serve_faults(self) -> None:
        """Let faults begin and end, and replies go on that were held back."""
        with self._faults_beginning():
            self._faults.begin_tick(self.tick)
        if held := self._faults.released(self.tick):
            self._put(held)

    @contextmanager
    def _faults_beginning(self) -> Iterator[None]:
        """Let the client go when a fault that begins in this block takes the port away."""
        was_up = not self.hung_up
        yield
        if was_up and self.hung_up:
            self.disconnect()

    def _see_edge(self, angle_rad: float) -> None:
        """Latch, unless a fault hides the edge; one that bounces is followed by others."""
        if self._faults.misses_edge():
            return
        self._latch(angle_rad)
        for tick, fraction in self._faults.bounces(self.tick):
            self._triggers.add_edge(tick, fraction)

    def _latch(self, angle_rad: float) -> None:
        self._registers = self._registers._replace(latched_count=count_at(self._constants.encoder, angle_rad))

    def _serve_line(self) -> None:
        """Let a tick pass on the line; the firmware reads as long as it has room for a reply."""
        uart = self._uart
        uart.advance()
        while uart.readable and uart.transmit_room >= _LONGEST_REPLY:
            byte = uart.read()
            if byte is LOST:
                self._lines.spoil()
            else:
                self._interpret(bytes((byte,)))
        self._send(uart.transmit())

    def _interpret(self, data: bytes) -> None:
        self._heard += data if self.observer else b""
        for line in self._lines.feed(data):
            self._faults.lines_heard += 1
            if self._faults.present:
                with self._faults_beginning():
                    self._faults.begin_line(self.tick)
            reply = self._reply(line if isinstance(line, ErrorCode) else decode_command(line))
            if self._faults.present:
                reply = self._faults.on_a_reply(reply, self.tick)
            self._put(reply)

    def _put(self, reply: bytes) -> None:
        """Give a reply to the line."""
        if self.config.serial.baud:
            self._uart.write(reply)
        else:
            self._send(reply)

    def _reply(self, command: Command | ErrorCode) -> bytes:
        """Carry a line out and return its reply; in strict Table 1 mode a refused line has none."""
        if isinstance(command, Command):
            before = self._state.firmware
            reply, controller, self._registers = self._interpreter.execute(command, before, self._registers)
            if controller is not before:
                self._state = self._state._replace(firmware=controller)
                self._resting = False
        else:
            reply = Refusal(command)
        serial = self.config.serial
        return b"" if serial.strict and isinstance(reply, Refusal) else encode_reply(reply, serial.decimals)

    def _send(self, data: bytes) -> None:
        if self._faults.present:
            data = self._faults.on_the_line(data, TO_CLIENT)
        self._replies += data
        self._said += data if self.observer else b""

    def _woken(self, drive: DriveState) -> TableState:
        profile = Profile.of(self._registers.speed, self._registers.acceleration)
        count = count_at(self._constants.encoder, drive.angle_rad)
        return TableState(drive, power_on(self._constants.firmware, profile, count), 0)
