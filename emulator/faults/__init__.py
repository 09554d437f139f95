"""What can go wrong with a table, and when."""

from emulator.faults.fault import Fault, FaultError, fault_from

__all__ = ["Fault", "FaultError", "fault_from"]
