"""What can go wrong with a table, and when."""

from emulator.faults.fault import FaultError, fault_from
from protocol.bench import Fault

__all__ = ["Fault", "FaultError", "fault_from"]
