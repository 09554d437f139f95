"""Identification: the table's constants from a recording of its motion."""
