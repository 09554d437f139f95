"""Deliberately wrong tables: each violates one rule, and names the case that must detect it."""

from tests.protocol.conformance.mutants import (
    grammar,
    lines,
    motion,
    numbers,
    preemption,
    readings,
    recovery,
    replies,
    settings,
    targets,
    trigger,
)
from tests.protocol.conformance.mutants.mutant import MUTANTS, Mutant, port_to

__all__ = [
    "MUTANTS",
    "Mutant",
    "grammar",
    "lines",
    "motion",
    "numbers",
    "port_to",
    "preemption",
    "readings",
    "recovery",
    "replies",
    "settings",
    "targets",
    "trigger",
]
