"""Benchmarks: what a file measures beside its peers is its name."""
