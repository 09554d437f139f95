"""Benchmarks: every figure beside a peer that runs in the same minute on the same machine.

python -m tools.bench emulator
"""

import argparse
import sys
from collections.abc import Sequence
from importlib import import_module

SUBJECTS = ("emulator", "identify", "map", "planner", "scan", "stream")


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the named benchmarks and print their tables."""
    parser = argparse.ArgumentParser(
        prog="python -m tools.bench",
        description="Measure this machine's figures, each beside a peer.",
        epilog="example: python -m tools.bench emulator",
    )
    parser.add_argument("subject", choices=SUBJECTS, nargs="+")
    for subject in parser.parse_args(arguments).subject:
        import_module(f"tools.bench_{subject}").__dict__[f"bench_{subject}"](sys.stdout)
    return 0


if __name__ == "__main__":
    sys.exit(main())
