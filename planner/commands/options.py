"""What several commands make of their options."""

import sys


def fresh_table(url: str, **wanted: int) -> str:
    """Return a port's URL; a table that `emulator://` makes gets what is wanted, unless told others."""
    if not url.startswith("emulator://"):
        return url
    told = url.partition("?")[2]
    missing = [f"{key}={value}" for key, value in wanted.items() if f"{key}=" not in told]
    return "emulator://?" + "&".join(([told] if told else []) + missing)


def say(line: str) -> None:
    """Print a line for people beside the command's results, such as what was mended in a mesh."""
    sys.stderr.write(line + "\n")
