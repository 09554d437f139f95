"""Options that several commands have, and the numbers that options take."""

import argparse
import sys
from collections.abc import Callable
from pathlib import Path

from planner.cell.scan import shipped_scans
from planner.execution.execute import Settings
from planner.execution.run_on import DEFAULT_RUN_ON_DEG


def add_scan(parser: argparse.ArgumentParser) -> None:
    """Add the scan that the command is about."""
    parser.add_argument("scan", metavar="SCAN", help=f"a scan file, or one of {', '.join(shipped_scans())}")


def add_map(parser: argparse.ArgumentParser, configuration: str) -> None:
    """Add which configuration maps to compute, and how finely; `configuration` is the default."""
    parser.add_argument(
        "--configuration",
        metavar="NAME",
        default=configuration,
        help=f"such as LEFTY-ABOVE-NOFLIP, or {configuration} (the default)",
    )
    parser.add_argument(
        "--angles",
        type=whole_number(8, 36_000),
        default=360,
        metavar="COUNT",
        help="table angles over one turn (default 360)",
    )


def add_wire(parser: argparse.ArgumentParser) -> None:
    """Add what the line to the table is like."""
    parser.add_argument("--baud", type=whole_number(0, 1_000_000), default=9600, metavar="N", help="default 9600")
    parser.add_argument(
        "--decimals",
        type=whole_number(1, 6),
        default=1,
        metavar="N",
        help="places after the point on the wire (default 1)",
    )


def add_run_on(parser: argparse.ArgumentParser) -> None:
    """Add how far the table may run on when the line dies."""
    parser.add_argument(
        "--run-on",
        type=positive_number,
        default=DEFAULT_RUN_ON_DEG,
        metavar="DEG",
        help="maximum angle that the table runs on if the line dies, where the limits allow it (default %(default)g)",
    )


def add_stand_in(parser: argparse.ArgumentParser) -> None:
    """Add what is to be known of a stand-in at the port."""
    parser.add_argument(
        "--time-scale",
        type=positive_number,
        default=1.0,
        metavar="X",
        help="that of the stand-in at --port, if it is not 1",
    )
    parser.add_argument(
        "--control", type=Path, metavar="PATH", help="the control channel of a stand-in at --port, to see inside it"
    )


def add_lag(parser: argparse.ArgumentParser) -> None:
    """Add the encoder's lag behind the reference, which the wire does not show."""
    parser.add_argument(
        "--lag", type=number(0.0, 1.0), default=Settings().lag_s, metavar="S",
        help="lag of the encoder behind the table's reference (default %(default)s, that of the emulator)",
    )  # fmt: skip


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


def whole_number(least: int, most: int) -> Callable[[str], int]:
    """Return what reads a whole number within bounds."""

    def read(text: str) -> int:
        try:
            number = int(text)
        except ValueError:
            number = least - 1
        if not least <= number <= most:
            raise argparse.ArgumentTypeError(f"is {text}; allowed is a whole number from {least} to {most}")
        return number

    return read


def number(least: float, most: float) -> Callable[[str], float]:
    """Return what reads a number within bounds."""

    def read(text: str) -> float:
        try:
            value = float(text)
        except ValueError:
            value = float("nan")
        if not least <= value <= most:
            raise argparse.ArgumentTypeError(f"is {text}; allowed is a number from {least:g} to {most:g}")
        return value

    return read


def positive_number(text: str) -> float:
    """Return a number above 0, and not beyond anything that can be meant."""
    try:
        number = float(text)
    except ValueError:
        number = 0.0
    if not 0.0 < number <= 1000.0:
        raise argparse.ArgumentTypeError(f"is {text}; allowed is a number above 0 and at most 1000")
    return number
