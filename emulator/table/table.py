"""The whole table in one object, without threads or clock: bytes in, bytes out, and ticks."""

import copy
import math
import random
from collections.abc import Iterable
from typing import NamedTuple

from emulator.config.table_config import TableConfig
from emulator.faults.line_faults import LINE_KINDS
from emulator.faults.schedule import PORT_KINDS, FaultSchedule
from emulator.faults.trigger_faults import TRIGGER_KINDS
from emulator.firmware.profiler import Profile
from emulator.int32 import wrap_int32
from emulator.plant.drive_train import DriveState, at_standstill
from emulator.plant.encoder import angle_within_tick, count_at, recounted
from emulator.table.control_loop import ControlLoop
from emulator.table.drive_faults import DRIVE_KINDS, is_faulty
from emulator.table.fast_ticks import Run
from emulator.table.interpreter import Interpreter, Registers
from emulator.table.serial_end import SerialEnd
from emulator.table.status import table_facts, table_status
from emulator.table.tick import TableConstants, TableState, table_constants, woken
from emulator.table.trigger import TriggerInput
from protocol.bench import Fault, Observer, TableStatus
from protocol.codec import decode_command, encode_reply
from protocol.messages import Command, ErrorCode, Refusal

_EFFECTIVE_FAULTS = LINE_KINDS | PORT_KINDS | DRIVE_KINDS | TRIGGER_KINDS


class Snapshot(NamedTuple):
    """Everything that determines the future of a table, except its configuration."""

    tick: int
    constants: TableConstants
    state: TableState
    registers: Registers
    serial: SerialEnd
    triggers: TriggerInput
    faults: FaultSchedule
    load_torque_Nm: float
    true_zero_rad: float


class Table:
    """A rotary table: firmware and plant with a serial line, in simulated time.

    The same configuration, seed, bytes and ticks give the same bytes and bit-identical states. The seed determines the
    position of the shaft between two encoder edges, and of the teeth in the backlash, at power-on.

    Attributes:
        config: the table's constants.
        facts: the constants that its clients may use.
        tick: ticks since power-on.
        observer: called after every tick, if set.
    """

    def __init__(self, config: TableConfig, seed: int = 0, run: Run | None = None) -> None:
        """Switch the table on, at rest at 0 degrees.

        Args:
            config: the table's constants.
            seed: determines the positions of shaft and gear teeth.
            run: computes undisturbed ticks when the state is read. Without it, they are interpreted at once.
        """
        chance = random.Random(seed)  # noqa: S311  # not for security
        tick_hz = config.control.tick_hz
        self.config = config
        self.facts = table_facts(config)
        self.tick = 0
        self.observer: Observer | None = None
        self._interpreter = Interpreter(config)
        self._registers = self._interpreter.power_on()
        self._run = run
        constants = table_constants(config, encoder_phase=chance.random())
        drive = at_standstill(constants.drive, gap_share=chance.uniform(-1.0, 1.0))
        self._loop = ControlLoop(constants, self._woken(constants, drive), run=run)
        self._true_zero_rad = 0.0
        self._faults = FaultSchedule(config.faults, tick_hz, seed, _EFFECTIVE_FAULTS)
        self._serial = SerialEnd(config, self._faults)
        self._triggers = TriggerInput(tick_hz, self._faults)

    def receive(self, data: bytes) -> None:
        """Take bytes that the client sends now."""
        self._carry_out(self._serial.receive(data))
        if self.observer is None:
            self._serial.overheard()  # discarded without an observer

    def transmit(self) -> bytes:
        """Return and remove the bytes that have been sent by now."""
        return self._serial.transmit()

    def ticks_until_byte(self) -> int | None:
        """Return the ticks until the next byte in either direction is complete; None while the line is idle."""
        return self._serial.ticks_until_byte(self.tick)

    def disconnect(self) -> None:
        """Disconnect the client: its incomplete line and its unsent replies are discarded, its motion continues."""
        self._serial.disconnect()

    @property
    def hung_up(self) -> bool:
        """Whether a fault has removed the port."""
        return self._faults.hangs_up

    def inject(self, fault: Fault) -> None:
        """Inject a fault, now or at the time that the fault specifies."""
        if self._faults.inject(fault, self.tick):
            self.disconnect()

    def clear_faults(self) -> None:
        """End all faults and cancel the scheduled ones. Delayed replies are still sent later."""
        self._faults.clear()

    @property
    def trigger_hz(self) -> float:
        """The rate of the periodic trigger; 0 turns it off."""
        return self._triggers.rate_hz

    @trigger_hz.setter
    def trigger_hz(self, rate_hz: float) -> None:
        self._triggers.start_train(rate_hz, self.tick)

    def trigger(self, fraction: float = 0.0) -> None:
        """Apply an edge to the trigger input at a fraction (0..1) of the coming tick.

        The latch stores the position of that instant.
        """
        if not 0.0 <= fraction < 1.0:
            raise ValueError(f"an edge at {fraction} of a tick is outside 0..1")
        if fraction == 0.0:
            self._see_edge(self._loop.state.drive.angle_rad)
        else:
            self._triggers.add_edge(self.tick, fraction)

    def set_load_torque(self, torque_Nm: float) -> None:
        """Apply a load torque that opposes positive rotation, until the next call."""
        if not math.isfinite(torque_Nm):
            raise ValueError(f"a load torque of {torque_Nm} Nm is not finite")
        self._loop.load_torque_Nm = float(torque_Nm)

    def reset(self, count: int = 0) -> None:
        """Switch the table off and on. The controller starts at `count`, and the plant continues."""
        loop, drive = self._loop, self._loop.state.drive
        encoder = loop.constants.encoder
        loop.constants = loop.constants._replace(encoder=recounted(encoder, drive.angle_rad, count))
        self._true_zero_rad = (drive.angle_rad - count / encoder.count_rad) * loop.constants.drive.table_per_motor
        self.disconnect()
        self._registers = self._interpreter.power_on()._replace(latched_count=wrap_int32(count))
        loop.state = self._woken(loop.constants, drive)

    @property
    def duty(self) -> int:
        """The duty on the bridge in the coming tick, in PWM steps; below 0 it drives backwards."""
        return self._loop.state.duty

    @property
    def received_queue(self) -> int:
        """Number of bytes in transmission to the firmware."""
        return self._serial.uart.waiting_count

    @property
    def outgoing(self) -> bytes:
        """Number of bytes of replies that have not been sent yet."""
        return self._serial.uart.outgoing

    def ticks_until_sent(self, wanted: int) -> int | None:
        """Return the ticks until `wanted` bytes may have been sent, or a line is complete; None if neither occurs."""
        return self._serial.ticks_until_sent(wanted, self.tick)

    def status(self) -> TableStatus:
        """Return the present state of the table."""
        return table_status(
            self.config,
            self._loop.state,
            self._serial.uart,
            encoder=self._loop.constants.encoder,
            tick=self.tick,
            latched_count=self._registers.latched_count,
            load_torque_Nm=self._loop.load_torque_Nm,
            true_zero_rad=self._true_zero_rad,
        )

    def snapshot(self) -> Snapshot:
        """Return a copy of everything that determines the future of the table."""
        return copy.deepcopy(
            Snapshot(
                self.tick,
                self._loop.constants,
                self._loop.state,
                self._registers,
                self._serial,
                self._triggers,
                self._faults,
                self._loop.load_torque_Nm,
                self._true_zero_rad,
            )
        )

    def restore(self, snapshot: Snapshot) -> None:
        """Restore a snapshot of a table with this configuration."""
        (
            self.tick,
            constants,
            state,
            self._registers,
            self._serial,
            self._triggers,
            self._faults,
            load_torque_Nm,
            self._true_zero_rad,
        ) = copy.deepcopy(snapshot)
        self._loop = ControlLoop(constants, state, load_torque_Nm, self._run)

    def advance(self, ticks: int) -> None:
        """Advance the simulated time."""
        if ticks < 0:
            raise ValueError(f"time cannot go back by {-ticks} ticks")
        end = self.tick + ticks
        while self.tick < end:
            event = self.tick if self._is_busy() else self._next_event(end)
            if event <= self.tick:
                self._advance_watched()
            else:
                self._advance_undisturbed(event)
        self._serve_faults()
        if self._run is None:
            self._loop.catch_up()

    def _is_busy(self) -> bool:
        """Return whether each tick must be computed separately: for the line, the observer, or a faulty drive."""
        return self._serial.needs_each_tick or self.observer is not None or is_faulty(self._faults)

    def _next_event(self, end: int) -> int:
        """Return the tick, at most `end`, of the next external event.

        That is an edge, a complete line, or a fault that starts, ends or releases a reply.
        """
        line = self._serial.ticks_until_line()
        line_tick = None if line is None else self.tick + line
        events = (self._triggers.next_tick, self._faults.next_tick, self._serial.held_until, line_tick)
        return min([end, *(tick for tick in events if tick is not None)])

    def _advance_undisturbed(self, end: int) -> None:
        """Advance by ticks without external events. A state that repeats itself stays to the end."""
        ticks = end - self.tick
        self._loop.pass_ticks(ticks)
        self.tick = end
        self._carry_out(self._serial.pass_ticks(ticks))
        self._serial.overheard()  # discarded without an observer

    def _advance_watched(self) -> None:
        """Advance by one tick with the line, an edge, a fault or the observer."""
        self._serve_faults()
        loop, before = self._loop, self._loop.state.drive
        loop.step(self._faults, self.config.driver.supply_V)
        while (fraction := self._triggers.take(self.tick)) is not None:
            tick_s, end_rad = loop.constants.drive.tick_s, loop.state.drive.angle_rad
            self._see_edge(angle_within_tick(before.angle_rad, end_rad, before.speed_rad_s, tick_s, fraction))
        self.tick += 1
        if not self._serial.uart.idle:
            self._carry_out(self._serial.advance())
        heard, said = self._serial.overheard()
        if self.observer is not None:
            self.observer(self.status(), heard, said)

    def _serve_faults(self) -> None:
        """Start and end faults, and send delayed replies that are due."""
        if self._faults.begin_tick(self.tick):
            self.disconnect()
        self._serial.release(self.tick)

    def _see_edge(self, angle_rad: float) -> None:
        """Latch the position at a trigger edge, unless a fault hides the edge."""
        if self._triggers.sees_edge(self.tick):
            latched_count = count_at(self._loop.constants.encoder, angle_rad)
            self._registers = self._registers._replace(latched_count=latched_count)

    def _carry_out(self, lines: Iterable[bytes | ErrorCode]) -> None:
        """Reply to lines that the firmware has read, to each one before the next one is read."""
        for line in lines:
            if reply := self._answer(line):
                self._serial.write(reply, self.tick)

    def _answer(self, line: bytes | ErrorCode) -> bytes:
        """Execute a line that the firmware has read, after the start of the faults that wait for it."""
        if self._faults.begin_line(self.tick):
            self.disconnect()
        return self._reply(line if isinstance(line, ErrorCode) else decode_command(line))

    def _reply(self, command: Command | ErrorCode) -> bytes:
        """Execute a command and return its reply. In strict Table 1 mode, a refused line has no reply."""
        if isinstance(command, Command):
            state = self._loop.state
            reply, controller, self._registers = self._interpreter.execute(command, state.firmware, self._registers)
            if controller is not state.firmware:
                self._loop.state = state._replace(firmware=controller)
        else:
            reply = Refusal(command)
        serial = self.config.serial
        return b"" if serial.strict and isinstance(reply, Refusal) else encode_reply(reply, serial.decimals)

    def _woken(self, constants: TableConstants, drive: DriveState) -> TableState:
        return woken(constants, drive, Profile.of(self._registers.speed, self._registers.acceleration))
