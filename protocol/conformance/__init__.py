"""The conformance kit: one suite for the emulator and for a real table, case by clause of the specification."""
