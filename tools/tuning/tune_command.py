"""Run `python -m tools.tune`: search or judge gains, and write the results."""

import argparse
import shlex
import sys
from contextlib import ExitStack
from math import inf
from pathlib import Path

from emulator.config.table_config import load_config
from protocol.files.whole_file import whole_file
from protocol.program.color import colored
from protocol.program.command_line import program_name
from protocol.program.page import Origin
from protocol.program.progress import share_shown
from tools.bounds import Limits, TuningError
from tools.command_line import check_folder
from tools.tuning.figures_json import figures_json
from tools.tuning.gain_design import Design
from tools.tuning.gain_files import gains_header, gains_toml
from tools.tuning.given_gains import given_gains
from tools.tuning.tune_plots import plots
from tools.tuning.tune_report import tune_report, verdict
from tools.tuning.tuned_table import Terms, Tuning, judge, tune

_TUNE_FOLDER, _JUDGE_FOLDER = Path("build/tune"), Path("build/judge")


def run(options: argparse.Namespace) -> int:
    """Search or judge gains, write all files, and return the exit status.

    Raises:
        TuningError: An option cannot be used, or bounds cannot be satisfied.
        ConfigError: A file cannot be used.
    """
    if options.judge:
        return _judge(options)
    config = load_config(options.config)
    terms = _terms(options)
    folder = options.out or _TUNE_FOLDER
    check_folder(folder)
    with share_shown("tuning") as progress:
        tuning = tune(config, terms, progress)
    _write(folder, tuning, options.command_line)
    if not tuning.feasible:
        raise TuningError(_refusal(tuning, options))
    _print(tuning)
    return 0


def _judge(options: argparse.Namespace) -> int:
    config, gains = given_gains(options.judge, options.config)
    terms = _terms(options)
    folder = options.out or _JUDGE_FOLDER
    if options.judge.resolve() == (folder / "gains.toml").resolve():
        raise TuningError(f"{options.judge} would be overwritten; --out must be another folder")
    check_folder(folder)
    with share_shown("judging") as progress:
        tuning = judge(config, gains, terms, progress)
    _write(folder, tuning, options.command_line)
    _print(tuning)
    print(colored(verdict(tuning), "good" if tuning.feasible else "bad", sys.stdout))
    return 0 if tuning.feasible else 1


def _refusal(tuning: Tuning, options: argparse.Namespace) -> str:
    """Return which bounds cannot be satisfied, and a command line that works."""
    sets = [
        f"the {tuned.title} breaks {', '.join(map(tuned.design.stated, tuned.design.broken))}"
        for tuned in tuning.sets.values()
        if tuned.design.broken
    ]
    way = "no working command line was found"
    if tuning.eased is not None:
        way = f"this works: {_command_line(options, tuning.eased)}"
    return f"no gains satisfy all bounds; of the nearest {' and '.join(sets)}; {way}"


def _command_line(options: argparse.Namespace, limits: Limits) -> str:
    """Return the command line with other limits."""
    words = program_name("tools.tune").split()
    if options.out is not None:
        words += ["--out", str(options.out)]
    if options.config is not None:
        words += ["--config", str(options.config)]
    for bound, usual in zip(limits.for_hold(), Limits().for_hold(), strict=True):
        if bound != usual:
            words += bound.option.split()
    for name in ("plants", "spread", "seed"):
        if (value := getattr(options, name)) != options.defaults[name]:
            words += [f"--{name}", f"{value:g}"]
    return shlex.join(words)


def _terms(options: argparse.Namespace) -> Terms:
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
    limits = Limits(
        options.ms,
        options.gain_margin,
        options.phase_margin,
        options.noise / 100.0,
        options.bandwidth,
        options.overshoot / 100.0,
        options.settling / 1e3,
    )
    return Terms(limits, options.plants, options.spread / 100.0, options.seed)


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
