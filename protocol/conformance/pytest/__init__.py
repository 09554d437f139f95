"""The kit as a part of pytest."""
