"""What faults do to a table: to the bytes on its line, to its drive and encoder, to its trigger.

The table asks at a few places, and only while there is a fault that could have an answer. Chance is seeded: the same
faults strike the same bytes at the same ticks.
"""

import math
from collections import deque
from random import Random
from typing import NamedTuple

from emulator.config import TableConfig
from emulator.drive_train import step as drive_step
from emulator.encoder import count_at
from emulator.faults import KINDS, Fault
from emulator.firmware import step as firmware_step
from emulator.fixed_point import wrap_int32
from emulator.framing import read_at_rate
from emulator.friction import Friction
from emulator.tick import TableConstants, TableState

_DRIVE = frozenset(
    ("stall", "extra-load", "supply-sag", "stuck-pwm", "one-sided", "lost-counts", "swapped-encoder", "dead-encoder")
)
_HELD_OVER_STALL = 4.0
"""What holds a stalled table, over the motor's own stall torque."""

TO_TABLE, TO_CLIENT = 1, -1


class Plan(NamedTuple):
    """A fault that waits for its time or its command, with the ticks that it lasts."""

    fault: Fault
    begin_tick: int | None
    ticks: int | None


class Active(NamedTuple):
    """A fault that holds, until a tick or until it is cleared."""

    fault: Fault
    end_tick: int | None


class Faults:
    """The faults of one table: those to come, and those that hold.

    Attributes:
        present: whether there is any, or bytes are held back; while there is none a table need not ask.
        lines_heard: commands that the table has heard.
    """

    def __init__(self, config: TableConfig, seed: int) -> None:
        """Take the faults of a configuration; one without a beginning holds from the start."""
        self._baud = config.serial.baud
        self._tick_hz = config.control.tick_hz
        self._supply_V = config.driver.supply_V
        self._chance = Random(f"faults {seed}")  # noqa: S311  # no secret
        self._plans: list[Plan] = []
        self._active: dict[str, Active] = {}
        self._held: deque[tuple[int, bytes]] = deque()
        self.present = False
        self.lines_heard = 0
        self._bounce_end_tick = 0
        for fault in config.faults:
            self.inject(fault, 0)

    def inject(self, fault: Fault, tick: int) -> None:
        """Add a fault, which replaces one of its kind that holds, from its beginning or else from now on."""
        begin = None if fault.at_command is not None else tick
        if fault.at_s is not None:
            begin = max(round(fault.at_s * self._tick_hz), tick)
        ticks = None if fault.for_s is None else max(1, round(fault.for_s * self._tick_hz))
        self._plans.append(Plan(fault, begin, ticks))
        self.begin_tick(tick)

    def clear(self) -> None:
        """End all faults, and forget those to come."""
        self._plans.clear()
        self._active.clear()
        self.present = bool(self._held)

    @property
    def turns_the_drive(self) -> bool:
        """Whether a tick of plant and controller is another than that of a sound table."""
        return bool(self._active) and not _DRIVE.isdisjoint(self._active)

    @property
    def hangs_up(self) -> bool:
        """Whether the port has gone away."""
        return "hang-up" in self._active

    @property
    def next_tick(self) -> int | None:
        """The tick at which a fault begins or ends, or held bytes are due; None where nothing is to come."""
        if not self.present:
            return None
        ticks = [plan.begin_tick for plan in self._plans] + [one.end_tick for one in self._active.values()]
        ticks += [self.held_until]
        return min((tick for tick in ticks if tick is not None), default=None)

    @property
    def held_until(self) -> int | None:
        """The tick at which bytes that are held back go on; None where there are none."""
        return self._held[0][0] if self._held else None

    def begin_tick(self, tick: int) -> None:
        """End the faults that are over, and begin those that are due."""
        for name in [name for name, one in self._active.items() if one.end_tick is not None and one.end_tick <= tick]:
            del self._active[name]
        self._begin([plan for plan in self._plans if plan.begin_tick is not None and plan.begin_tick <= tick], tick)
        self.present = bool(self._plans or self._active or self._held)

    def begin_line(self, tick: int) -> None:
        """Begin the faults that wait for the command that was heard last."""
        self._begin([plan for plan in self._plans if plan.fault.at_command == self.lines_heard], tick)

    # On the line

    def on_the_line(self, data: bytes, direction: int) -> bytes:
        """Return what becomes of bytes on their way to the table or to the client."""
        if not self._active:
            return data
        if self.hangs_up or ("silence" in self._active and direction == TO_CLIENT):
            return b""
        if (fault := self._holding("wrong-baud")) and self._baud:
            table_baud = int(fault.value("baud"))
            sender, receiver = (self._baud, table_baud) if direction == TO_TABLE else (table_baud, self._baud)
            data = read_at_rate(data, sender, receiver)
        if (fault := self._holding("drop")) and fault.value("direction") in {0.0, direction}:
            data = bytes(byte for byte in data if self._chance.random() >= fault.value("probability"))
        if (fault := self._holding("flip")) and fault.value("direction") in {0.0, direction}:
            data = bytes(self._flipped(byte, fault.value("probability")) for byte in data)
        return data

    def on_a_reply(self, reply: bytes, tick: int) -> bytes:
        """Return what the table sends of a reply now; the rest is lost, or held back."""
        if not (self._active or self._held):
            return reply
        if fault := self._spent("half-reply"):
            reply = reply[: int(fault.value("bytes"))]
        late_s = fault.value("seconds") if (fault := self._spent("late-reply")) else 0.0
        if fault := self._holding("delay"):
            late_s += fault.value("seconds")
        due = max(tick + round(late_s * self._tick_hz), self._held[-1][0] if self._held else tick)
        if due == tick:
            return reply
        self._held.append((due, reply))
        return b""

    def released(self, tick: int) -> bytes:
        """Return the replies whose time has come."""
        data = b""
        while self._held and self._held[0][0] <= tick:
            data += self._held.popleft()[1]
        return data

    def disconnect(self) -> None:
        """Forget what is held back: the client has gone."""
        self._held.clear()

    # On the drive and the encoder

    def step(
        self, constants: TableConstants, state: TableState, load_torque_Nm: float
    ) -> tuple[TableConstants, TableState]:
        """Return the table one tick later, as `tick.step` does; what the encoder missed stays missed, in its phase."""
        duty_max = constants.firmware.pid.duty_max
        duty, supply, train = state.duty, 1.0, constants.drive
        if fault := self._holding("stuck-pwm"):
            duty = round(fault.value("duty") * duty_max)
        if (fault := self._holding("one-sided")) and duty * fault.value("direction") <= 0:
            duty = 0
        if fault := self._holding("supply-sag"):
            supply = fault.value("supply_V") / self._supply_V
        if fault := self._holding("extra-load"):
            load_torque_Nm += fault.value("torque_Nm")
        if self._holding("stall"):
            holding_Nm = _HELD_OVER_STALL * train.torque_constant_Nm_A * self._supply_V / train.resistance_ohm
            train = train._replace(friction=Friction(holding_Nm, holding_Nm, train.friction.stribeck_s_rad))
        drive = drive_step(train, state.drive, duty * supply * constants.volts_per_duty, load_torque_Nm)
        before = state.firmware.counts[-1]
        turned = wrap_int32(count_at(constants.encoder, drive.angle_rad) - before)
        counted = self._counted(turned)
        if counted != turned:
            phase = constants.encoder.phase + (counted - turned)
            constants = constants._replace(encoder=constants.encoder._replace(phase=phase))
        controller = firmware_step(constants.firmware, state.firmware, wrap_int32(before + counted))
        return constants, TableState(drive, controller, state.firmware.pid.duty)

    # On the trigger

    def misses_edge(self) -> bool:
        """Return whether this edge of the trigger is not seen."""
        fault = self._holding("missed-trigger")
        return fault is not None and self._chance.random() < fault.value("probability")

    def bounces(self, tick: int) -> list[tuple[int, float]]:
        """Return the edges that follow one in this tick, each a tick and a fraction; they do not bounce themselves."""
        fault = self._holding("bounced-trigger")
        if fault is None or tick < self._bounce_end_tick:
            return []
        span = fault.value("within_s") * self._tick_hz
        self._bounce_end_tick = tick + math.ceil(span) + 1
        times = [tick + self._chance.random() * span for _ in range(int(fault.value("edges")))]
        return [(math.floor(time), time - math.floor(time)) for time in times]

    def _begin(self, plans: list[Plan], tick: int) -> None:
        for plan in plans:
            self._plans.remove(plan)
            end = None if plan.ticks is None else tick + plan.ticks
            self._active[plan.fault.kind] = Active(plan.fault, end)

    def _holding(self, kind: str) -> Fault | None:
        one = self._active.get(kind)
        return None if one is None else one.fault

    def _spent(self, kind: str) -> Fault | None:
        """Return a fault that strikes once, which is over with this."""
        assert KINDS[kind].strikes_once
        one = self._active.pop(kind, None)
        return None if one is None else one.fault

    def _flipped(self, byte: int, probability: float) -> int:
        return byte ^ 1 << self._chance.randrange(8) if self._chance.random() < probability else byte

    def _counted(self, turned: int) -> int:
        if self._holding("dead-encoder"):
            return 0
        if fault := self._holding("lost-counts"):
            seen = sum(self._chance.random() >= fault.value("probability") for _ in range(abs(turned)))
            turned = int(math.copysign(seen, turned))
        return -turned if self._holding("swapped-encoder") else turned
