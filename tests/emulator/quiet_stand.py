"""A stand-in that stands still, for the control channel to act on."""

from emulator.config.table_config import load_config
from emulator.faults.fault import Fault
from emulator.table.status import TableStatus
from emulator.table.table import Table


class QuietStand:
    """A table that stands still, with a list of what was done to it."""

    def __init__(self) -> None:
        self.time_scale = 1.0
        self.done: list[object] = []
        self.table = Table(load_config())

    def trigger(self) -> None:
        self.done.append("trigger")

    def status(self) -> TableStatus:
        return self.table.status()

    def set_load_torque(self, torque_Nm: float) -> None:
        self.done.append(torque_Nm)

    def set_time_scale(self, time_scale: float) -> None:
        self.time_scale = time_scale

    def reset(self) -> None:
        self.done.append("reset")

    def preset(self, count: int) -> None:
        self.done.append(count)

    def inject(self, fault: Fault) -> None:
        self.done.append(fault.kind)

    def clear_faults(self) -> None:
        self.done.append("clear-faults")

    def quit(self) -> None:
        self.done.append("quit")
