"""The faults of a table, and their schedule."""

from emulator.faults.fault import FaultError, fault_from
from protocol.bench import Fault

__all__ = ["Fault", "FaultError", "fault_from"]
