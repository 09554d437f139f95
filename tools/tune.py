"""Tune the two gain sets from the table's model, within stated margins, and check them on the emulator.

    python -m tools.tune --out build/tune
    python -m tools.tune --config table.toml --ms 1.6 --noise 0.3 --out build/tune
    python -m tools.tune --judge gains.toml --out build/judge

Writes gains.toml (for `python -m emulator --config`), gains.h, figures.json, report.html and its plots. Where no gains
keep all bounds, it writes all but gains.toml and gains.h, prints a command line that works, and ends with status 2.

With --judge no gains are searched: the same report is written for the gains of a file, whether the bounds hold or not.
Its [gains.ramp] and [gains.hold] have proportional_duty_s_deg, integral_time_s and derivative_time_s. The exit status
is 0 if all bounds hold, 1 if not, and 2 for an input that cannot be used.
"""

import protocol.quiet_start  # noqa: F401 - before the imports that take long

# isort: split
import argparse
import shlex
import sys
from contextlib import ExitStack
from math import inf
from pathlib import Path

from emulator.config.table_config import ConfigError, load_config
from protocol.command_line import Parser, program_name
from protocol.ending import ended
from protocol.page import Origin
from protocol.progress import share_shown
from protocol.whole_file import whole_file
from tools.command_line import check_folder
from tools.tuning.bounds import Limits
from tools.tuning.figures_json import figures_json
from tools.tuning.gain_design import Design
from tools.tuning.gain_files import gains_header, gains_toml
from tools.tuning.given_gains import given_gains
from tools.tuning.tune_plots import plots
from tools.tuning.tune_report import tune_report, verdict
from tools.tuning.tuned_table import Tuning, TuningError, judge, tune

_TUNE_FOLDER, _JUDGE_FOLDER = Path("build/tune"), Path("build/judge")


def main(arguments: list[str] | None = None) -> int:
    """Run the command line; return its exit status."""
    options = parser().read(arguments)
    return ended("tune", lambda: _tune(options), ConfigError, TuningError)


def _tune(options: argparse.Namespace) -> int:
    if options.judge:
        return _judge(options)
    config = load_config(options.config)
    limits = _limits(options)
    folder = options.out or _TUNE_FOLDER
    check_folder(folder)
    with share_shown("tuning") as progress:
        tuning = tune(config, limits, options.plants, options.spread / 100.0, options.seed, progress)
    _write(folder, tuning, options.command_line)
    if not tuning.feasible:
        raise TuningError(_refusal(tuning, options))
    _print(tuning)
    return 0


def _judge(options: argparse.Namespace) -> int:
    config, gains = given_gains(options.judge, options.config)
    limits = _limits(options)
    folder = options.out or _JUDGE_FOLDER
    if options.judge.resolve() == (folder / "gains.toml").resolve():
        raise TuningError(f"{options.judge} would be overwritten; --out must be another folder")
    check_folder(folder)
    with share_shown("judging") as progress:
        tuning = judge(config, gains, limits, options.plants, options.spread / 100.0, options.seed, progress)
    _write(folder, tuning, options.command_line)
    _print(tuning)
    print(verdict(tuning))
    return 0 if tuning.feasible else 1


def _refusal(tuning: Tuning, options: argparse.Namespace) -> str:
    """Return which bounds cannot be kept, and a command line that works."""
    sets = [
        f"the {tuned.title} breaks {', '.join(map(tuned.design.stated, tuned.design.broken))}"
        for tuned in tuning.sets.values()
        if tuned.design.broken
    ]
    way = "no command line was found that works"
    if tuning.eased is not None:
        way = f"this works: {_command_line(options, tuning.eased)}"
    return f"no gains keep all bounds; of the nearest {' and '.join(sets)}; {way}"


def _command_line(options: argparse.Namespace, limits: Limits) -> str:
    """Return the command line with other limits."""
    words = ["python", "-m", "tools.tune"]
    if options.out is not None:
        words += ["--out", str(options.out)]
    if options.config is not None:
        words += ["--config", str(options.config)]
    for bound, usual in zip(limits.for_hold(), Limits().for_hold(), strict=True):
        if bound != usual:
            words += bound.option.split()
    for name in ("plants", "spread", "seed"):
        if (value := getattr(options, name)) != parser().get_default(name):
            words += [f"--{name}", f"{value:g}"]
    return shlex.join(words)


def _limits(options: argparse.Namespace) -> Limits:
    for name in ("ms", "gain_margin", "phase_margin", "noise", "bandwidth", "overshoot", "settling"):
        value, least = getattr(options, name), 1.0 if name == "ms" else 0.0
        if not least < value < inf:
            raise TuningError(f"--{name.replace('_', '-')} is {value:g}; it must be a number greater than {least:g}")
    if options.plants < 1:
        raise TuningError(f"--plants is {options.plants}; it must be at least 1")
    if not 0.0 <= options.spread < 100.0:
        raise TuningError(f"--spread is {options.spread:g}; it must be at least 0 and less than 100 %")
    if options.seed < 0:
        raise TuningError(f"--seed is {options.seed}; it must be at least 0")
    return Limits(
        options.ms,
        options.gain_margin,
        options.phase_margin,
        options.noise / 100.0,
        options.bandwidth,
        options.overshoot / 100.0,
        options.settling / 1e3,
    )


def _write(folder: Path, tuning: Tuning, command: str) -> None:
    """Write all files, or none of them."""
    drawings = plots(tuning)
    files = {}
    if tuning.feasible:
        gains = {name: tuned.design.gains for name, tuned in tuning.sets.items()}
        files = {"gains.toml": gains_toml(tuning.after), "gains.h": gains_header(tuning.after, gains)}
    files |= {f"{name}.svg": drawing for name, drawing in drawings.items()}
    files["figures.json"] = figures_json(tuning)
    files["report.html"] = tune_report(tuning, drawings, Origin(command))
    folder.mkdir(parents=True, exist_ok=True)
    with ExitStack() as stack:
        for name, text in files.items():
            stack.enter_context(whole_file(folder / name)).write_text(text, encoding="utf-8")
    written = "gains.toml, gains.h, figures.json, report.html" if tuning.feasible else "figures.json, report.html"
    print(f"wrote {written} and plots to {folder}", file=sys.stderr)


def _print(tuning: Tuning) -> None:
    for name, tuned in tuning.sets.items():
        gains = getattr(tuning.after.gains, name)
        print(
            f"{tuned.title}: K {gains.proportional_duty_s_deg:.5f} duty s/deg, "
            f"Ti {1e3 * gains.integral_time_s:.3f} ms, Td {1e3 * gains.derivative_time_s:.3f} ms; "
            f"{_bounds(tuned.design)}; "
            f"{100 * tuned.spread.all_share:.0f} % of the spread plants meet all bounds"
        )
    for before, after in tuning.checks:
        for old, new in zip(before.figures, after.figures, strict=True):
            predicted = "" if new.model is None else f" (model {new.model:.3g})"
            print(f"{new.title}: {old.emulator:.3g} -> {new.emulator:.3g} {new.unit}{predicted}")


def _bounds(design: Design) -> str:
    if not design.figures.stable[0]:
        return "not stable"
    if design.broken:
        return f"breaks {', '.join(map(str, design.broken))}"
    return f"bounded by {', '.join(map(str, design.binding)) or 'nothing'}"


def parser() -> Parser:
    """Return the parser of the command line."""
    defaults = Limits()
    parser = Parser(
        prog=program_name("tools.tune"), description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--config", type=Path, help="TOML with the table's constants that differ from the default ones")
    parser.add_argument("--judge", type=Path, metavar="GAINS.toml", help="gains to judge, instead of a search")
    parser.add_argument(
        "--out", type=Path, metavar="DIR", help=f"output folder (default: {_TUNE_FOLDER}, with --judge {_JUDGE_FOLDER})"
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
