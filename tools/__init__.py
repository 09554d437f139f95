"""Command-line tools: tuning, identification, figures and benchmarks."""

import protocol.quiet_start  # noqa: F401 - before the imports that take long
