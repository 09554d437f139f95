"""The cases, by chapter of the specification; importing this package registers them."""

from protocol.conformance.cases import (
    grammar,
    lines,
    motion,
    preemption,
    readings,
    recovery,
    registers,
    replies,
    serial_line,
    settings,
    stateful,
    targets,
)

__all__ = [
    "grammar",
    "lines",
    "motion",
    "preemption",
    "readings",
    "recovery",
    "registers",
    "replies",
    "serial_line",
    "settings",
    "stateful",
    "targets",
]
