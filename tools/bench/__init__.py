"""Benchmarks; each file is named after what it measures."""

import protocol.program.quiet_start  # noqa: F401 - before the slow imports
