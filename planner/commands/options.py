"""Helpers for options of several commands."""

import sys


def fresh_table(url: str, **wanted: int) -> str:
    """Return the URL of a port. For `emulator://`, add the wanted settings unless the URL has its own."""
    if not url.startswith("emulator://"):
        return url
    told = url.partition("?")[2]
    missing = [f"{key}={value}" for key, value in wanted.items() if f"{key}=" not in told]
    return "emulator://?" + "&".join(([told] if told else []) + missing)


def say(line: str) -> None:
    """Print a line for the user besides the results of the command, such as repairs of a mesh."""
    sys.stderr.write(line + "\n")
