"""The constants of a table, read from TOML."""
