"""Tune the two gain sets from the table's model, within stated margins, and check them on the emulator."""

import protocol.program.quiet_start  # noqa: F401 - before the slow imports

# isort: split
import argparse
import sys
from importlib import import_module
from pathlib import Path

from emulator.config.table_config import ConfigError
from protocol.program.command_line import Parser, program_name
from protocol.program.ending import ended
from tools.bounds import Limits, TuningError

_EXAMPLES = """examples:
  {tune} --out build/tune
  {tune} --config table.toml --ms 1.6 --noise 0.3 --out build/tune
  {tune} --judge gains.toml --out build/judge

Writes gains.toml (for {table} --config), gains.h, figures.json, report.html and its plots. If no gains
satisfy all bounds, it writes all but gains.toml and gains.h, prints a command line that works, and ends with status 2.

With --judge no gains are searched: the same report is written for the gains of a file, whether they satisfy the bounds
or not. Its [gains.ramp] and [gains.hold] have proportional_duty_s_deg, integral_time_s and derivative_time_s. The exit
status is 0 if all bounds are satisfied, 1 if not, and 2 for invalid input.
"""


def main(arguments: list[str] | None = None) -> int:
    """Run the command line; return its exit status."""
    reader = parser()
    options = reader.read(arguments)
    options.defaults = {name: reader.get_default(name) for name in vars(options)}
    return ended(
        program_name("tools.tune"),
        lambda: int(import_module("tools.tuning.tune_command").run(options)),
        ConfigError,
        TuningError,
    )


def parser() -> Parser:
    """Return the parser of the command line."""
    defaults = Limits()
    parser = Parser(
        prog=program_name("tools.tune"),
        description=__doc__,
        epilog=_EXAMPLES.format(tune=program_name("tools.tune"), table=program_name("emulator")),
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--config", type=Path, help="TOML with the table's constants that differ from the default ones")
    parser.add_argument("--judge", type=Path, metavar="GAINS.toml", help="gains to judge, instead of a search")
    parser.add_argument(
        "--out", type=Path, metavar="DIR", help="output folder (default: build/tune, with --judge build/judge)"
    )
    parser.add_argument("--ms", type=float, default=defaults.sensitivity_peak, help="maximum Ms (default: %(default)s)")
    parser.add_argument(
        "--gain-margin",
        type=float,
        default=defaults.gain_margin_db,
        metavar="DB",
        help="minimum gain margin in dB (default: %(default)s)",
    )
    parser.add_argument(
        "--phase-margin",
        type=float,
        default=defaults.phase_margin_deg,
        metavar="DEG",
        help="minimum phase margin in deg (default: %(default)s)",
    )
    parser.add_argument(
        "--noise",
        type=float,
        default=100.0 * defaults.noise_duty,
        metavar="PERCENT",
        help="maximum noise at the PWM at the worst constant speed, standard deviation in percent of full duty "
        "(default: %(default)s)",
    )
    parser.add_argument(
        "--bandwidth",
        type=float,
        default=defaults.bandwidth_hz,
        metavar="HZ",
        help="minimum bandwidth at -3 dB in Hz (default: %(default)s)",
    )
    parser.add_argument(
        "--overshoot",
        type=float,
        default=100.0 * defaults.overshoot,
        metavar="PERCENT",
        help="maximum overshoot of the constant-speed set after a step (default: %(default)s)",
    )
    parser.add_argument(
        "--settling",
        type=float,
        default=1e3 * defaults.settling_s,
        metavar="MS",
        help="maximum time in which the constant-speed set settles to 10 %% after a step of speed or load "
        "(default: %(default)s)",
    )
    parser.add_argument(
        "--plants", type=int, default=1000, metavar="N", help="tables in the Monte Carlo (default: %(default)s)"
    )
    parser.add_argument(
        "--spread",
        type=float,
        default=20.0,
        metavar="PERCENT",
        help="spread of the constants in the Monte Carlo (default: %(default)s)",
    )
    parser.add_argument(
        "--seed", type=int, default=0, help="random seed of Monte Carlo and runs (default: %(default)s)"
    )
    return parser


if __name__ == "__main__":
    sys.exit(main())
