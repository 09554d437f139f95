"""Reproduce the paper's figures of the planner: `python -m tools.figures [--out DIR] [NAME...]`.

Fig. 5 is the shape of Eq. (1), Fig. 6 a configuration map with a plan in both views. Fig. 7 is the reference found by
Dijkstra's algorithm. Fig. 8 is ray shooting at four times, and Fig. 9 its speed and acceleration.
"""

import protocol.program.quiet_start  # noqa: F401 - before the slow imports

# isort: split
import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

from protocol.files.data_file import did_you_mean
from protocol.program.command_line import Parser, program_name
from protocol.program.ending import ended

NAMES = ("fig5", "fig6", "fig7", "fig8", "fig9")
"""Of `paper_figures.FIGURES`, which loads the planner and what draws."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Draw the requested figures and print the names of the files."""
    asked = parser()
    options = asked.parse_args(arguments)
    unknown = [name for name in options.names if name not in NAMES]
    if unknown:
        asked.error(f"NAME: is {unknown[0]}; allowed are {', '.join(NAMES)}{did_you_mean(unknown[0], NAMES)}")
    return ended(program_name("tools.figures"), lambda: _draw(options))


def parser() -> Parser:
    """Return the parser of the command line."""
    parser = Parser(
        prog=program_name("tools.figures"),
        description="Reproduce Fig. 5 to 9 of the paper.",
        epilog=f"example: {program_name('tools.figures')} --out build/figures fig8",
    )
    parser.add_argument("names", nargs="*", metavar="NAME", help=f"which figures (default: {' '.join(NAMES)})")
    parser.add_argument(
        "--out", type=Path, default=Path("figures"), metavar="DIR", help="output folder (default: figures)"
    )
    return parser


def _draw(options: argparse.Namespace) -> int:
    from planner.plot_style import save_picture  # noqa: PLC0415  # see `NAMES`
    from tools.paper_figures import FIGURES  # noqa: PLC0415

    for name in options.names or NAMES:
        figure, path = FIGURES[name](), options.out / f"{name}.png"
        try:
            options.out.mkdir(parents=True, exist_ok=True)
            save_picture(figure, path)
        except OSError as error:
            raise OSError(f"{options.out}: the figures cannot be written there ({error.strerror or error})") from error
        print(path)
    return 0


if __name__ == "__main__":
    sys.exit(main())
