"""Deliberately wrong tables: each breaks one rule, and names the case that is there to catch it."""

from tests.protocol.conformance.mutants import grammar, lines, motion, readings, replies, settings, trigger
from tests.protocol.conformance.mutants.mutant import MUTANTS, Mutant, port_to

__all__ = ["MUTANTS", "Mutant", "grammar", "lines", "motion", "port_to", "readings", "replies", "settings", "trigger"]
