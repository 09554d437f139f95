"""Draw a trace of the emulator: `python -m tools.plot_trace TRACE --out FILE.png`.

From top to bottom: reference and measured speed with their commands, position, and the state of the motor.
"""

import protocol.program.quiet_start  # noqa: F401 - before the slow imports

# isort: split
import argparse
import sys
from pathlib import Path

from protocol.program.command_line import Parser, program_name
from protocol.program.ending import ended
from tools.trace_signals import DEFAULT_SIGNALS, SIGNALS, check_signals

_EXAMPLES = """examples:
  {table} --pty --trace run.csv
  {trace} run.csv --out run.png
  {trace} run.csv --out detail.png --from 12 --to 14.5 --signals speed_deg_s,duty

Of commands close together the first ones are labeled, with the number of the others.
"""


def main(arguments: list[str] | None = None) -> int:
    """Run the command line and return its exit status."""
    options = parser().parse_args(arguments)
    return ended(program_name("tools.plot_trace"), lambda: _draw(options), ValueError)


def parser() -> Parser:
    """Return the parser of the command line."""
    table, trace = program_name("emulator"), program_name("tools.plot_trace")
    parser = Parser(
        prog=trace,
        description="Draw a trace that the emulator recorded.",
        epilog=_EXAMPLES.format(table=table, trace=trace),
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("trace", metavar="TRACE", type=Path, help=f"a .csv or .npz file of {table} --trace")
    parser.add_argument("--out", metavar="FILE", type=Path, required=True, help="the picture: .png, .svg or .pdf")
    parser.add_argument(
        "--from", dest="from_s", metavar="S", type=float, help="start time in s (default: of the trace)"
    )
    parser.add_argument("--to", dest="to_s", metavar="S", type=float, help="end time in s (default: of the trace)")
    parser.add_argument(
        "--signals",
        metavar="NAME,...",
        default=",".join(DEFAULT_SIGNALS),
        help=f"columns to draw, of {', '.join(SIGNALS)} (default: all but true_deg)",
    )
    return parser


def _draw(options: argparse.Namespace) -> int:
    signals = tuple(name.strip() for name in options.signals.split(",") if name.strip())
    check_signals(signals)
    from emulator.trace import read_trace  # noqa: PLC0415  # these load numpy and what draws
    from planner.plot_style import save_picture  # noqa: PLC0415
    from tools.trace_figure import draw_trace  # noqa: PLC0415

    figure = draw_trace(read_trace(options.trace), options.trace.name, options.from_s, options.to_s, signals)
    save_picture(figure, options.out)
    return 0


if __name__ == "__main__":
    sys.exit(main())
