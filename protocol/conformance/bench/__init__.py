"""The table under test: its wire, and what can be done to it beside the wire."""
