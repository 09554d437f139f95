"""The pytest part of the kit."""
