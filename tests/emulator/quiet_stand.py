"""An emulator at rest, for tests of the control channel."""

from emulator.config.table_config import load_config
from emulator.table.table import Table
from protocol.bench import Fault


class WatchedTable(Table):
    """A table at rest, with a list of the actions on it."""

    def __init__(self) -> None:
        super().__init__(load_config())
        self.done: list[object] = []

    def set_load_torque(self, torque_Nm: float) -> None:
        self.done.append(torque_Nm)

    def reset(self, count: int = 0) -> None:
        self.done.append(f"reset {count}")

    def inject(self, fault: Fault) -> None:
        self.done.append(fault)

    def clear_faults(self) -> None:
        self.done.append("clear-faults")


class QuietStand:
    """The server of this table."""

    def __init__(self) -> None:
        self.table = WatchedTable()
        self.time_scale = 1.0
        self.done = self.table.done

    def trigger(self) -> None:
        self.done.append("trigger")

    def set_time_scale(self, time_scale: float) -> None:
        self.time_scale = time_scale

    def quit(self) -> None:
        self.done.append("quit")
