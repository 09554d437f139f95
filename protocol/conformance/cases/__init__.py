"""The cases, by chapter of the specification; importing this package registers them."""

from protocol.conformance.cases import (
    commands,
    lines,
    motion,
    preemption,
    recovery,
    registers,
    replies,
    serial_line,
    stateful,
)

__all__ = ["commands", "lines", "motion", "preemption", "recovery", "registers", "replies", "serial_line", "stateful"]
