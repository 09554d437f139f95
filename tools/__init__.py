"""Command-line tools: tuning, identification, figures and benchmarks."""
