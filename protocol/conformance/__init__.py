"""The conformance kit: one suite for the stand-in and for a real table, case by clause of the specification."""
