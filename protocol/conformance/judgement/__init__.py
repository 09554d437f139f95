"""The correct behavior of a table, and the verdict on its actual behavior."""
