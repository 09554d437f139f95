"""Adaptive scanning: what was not seen yet, strips that would see it, which of them to scan, in which order."""
