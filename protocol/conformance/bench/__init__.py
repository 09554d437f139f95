"""The table under test: its serial line, and what the test bench can do to it."""
