"""Benchmarks: what a file measures beside its peers is its name."""

import protocol.quiet_start  # noqa: F401 - before the imports that take long
