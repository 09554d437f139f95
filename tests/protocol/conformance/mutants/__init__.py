"""Deliberately wrong tables: each breaks one rule, and names the case that is there to catch it."""

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
