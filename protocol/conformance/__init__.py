"""The conformance kit: one suite for the emulator and for a real table, with cases for each clause."""
