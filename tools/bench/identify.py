"""The accuracy of the constants from a recording of one minute, for tables that are unknown to the fit.

python -m tools.bench identify          ten random tables over emulator://
python -m tools.bench identify --wide   40 of a family twice as wide, and the default table with seeds 0 to 19
python -m tools.bench identify --pty    ten random tables over pseudo-terminals, in real time
"""

import subprocess
import tempfile
import time
from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from pathlib import Path
from statistics import fmean
from typing import NamedTuple, TextIO

import emulator  # noqa: F401  # teaches pyserial the port emulator://
from emulator.config.table_config import load_config
from protocol.client import TableClient
from protocol.program.own_program import own_environment, own_program
from tools.bench.identify_tables import DEFAULT, NARROW, WIDE, Family, write_constants
from tools.bench.timing import percentile, print_row, print_table
from tools.identification.constants import DERIVED
from tools.identification.errors import RecordingError
from tools.identification.excitation import excitation
from tools.identification.fit_checks import check_fit
from tools.identification.identify_table import identify
from tools.identification.recorder import record
from tools.identification.recording import WireRecording
from tools.identification.recording_checks import check_recording

_PLANTS, _WIDE_PLANTS, _DEFAULT_SEEDS = 10, 40, range(20)
_DURATION_S, _SPEED_DEG_S, _ACCELERATION_DEG_S2, _BAUD = 60.0, 40.0, 100.0, 9600
_ERROR_WIDTH = len("-100.0 * ?")


class Found(NamedTuple):
    """One estimate with the true value."""

    error: float
    inside: bool  # the true value is in the 95 % interval
    identifiable: bool


class Outcome(NamedTuple):
    """A fit: its estimates, its CPU time, and why it was refused, if it was."""

    constants: dict[str, Found]
    cpu_s: float
    refused: str


def bench(
    stream: TextIO, plants: int | None = None, seed: int = 1, jobs: int = 2, pty: bool = False, wide: bool = False
) -> None:
    """Print the errors for random tables."""
    family, usual = (WIDE, _WIDE_PLANTS) if wide else (NARROW, _PLANTS)
    _bench(stream, family, range(seed, seed + (plants or usual)), jobs, pty)
    if wide and plants is None:
        _bench(stream, DEFAULT, _DEFAULT_SEEDS, jobs, pty)


def _bench(stream: TextIO, family: Family, seeds: Sequence[int], jobs: int, pty: bool) -> None:
    line = "pseudo-terminals in real time" if pty else "emulator://"
    print(
        f"\nErrors in % for {family.title}, {_DURATION_S:g} s over {line}; * the truth is outside the 95 % interval, "
        "? not identifiable",
        file=stream,
    )
    names = [name for name, _, _ in DERIVED]
    header = ("seed, backlash", *names, "CPU, s", "within bounds")
    widths = [len(f"{seeds[-1]}, 10.0 arcmin"), *(max(len(name), _ERROR_WIDTH) for name in header[1:])]
    print_row(stream, header, widths)
    outcomes = []
    for seed, backlash_arcmin, outcome in _outcomes(family, seeds, jobs, pty):
        outcomes.append(outcome)
        cells = [_cell(outcome.constants[name]) if outcome.constants else "-" for name in names]
        verdict = outcome.refused or ("yes" if _within(outcome, family) else "NO")
        print_row(stream, (f"{seed}, {backlash_arcmin:.1f} arcmin", *cells, f"{outcome.cpu_s:.0f}", verdict), widths)
    _print_summary(stream, family, outcomes)


def _outcomes(family: Family, seeds: Sequence[int], jobs: int, pty: bool) -> Iterator[tuple[int, float, Outcome]]:
    """Yield seed, backlash (arcmin) and result of each table as soon as it is fitted."""
    with tempfile.TemporaryDirectory() as name, ProcessPoolExecutor(jobs) as workers:
        folder = Path(name)
        tables = [family.table(seed) for seed in seeds]
        known = [
            write_constants(folder / f"{seed}.known.toml", table.known)
            for seed, table in zip(seeds, tables, strict=True)
        ]
        truth = [
            write_constants(folder / f"{seed}.toml", table.known | table.hidden)
            for seed, table in zip(seeds, tables, strict=True)
        ]
        recordings = list(workers.map(partial(_recorded, pty=pty), truth, seeds))
        # Fitted after the recordings: it uses all cores, which would disturb a recording.
        outcomes = workers.map(_identified, known, truth, recordings)
        for seed, path, outcome in zip(seeds, truth, outcomes, strict=True):
            yield seed, load_config(path).gears.backlash_arcmin, outcome


def _cell(found: Found) -> str:
    return f"{100.0 * found.error:+.1f}{'' if found.inside else ' *'}{'' if found.identifiable else ' ?'}"


def _print_summary(stream: TextIO, family: Family, outcomes: Sequence[Outcome]) -> None:
    """Print the share of correct intervals, and the size of the errors, per constant."""
    accepted = [outcome.constants for outcome in outcomes if not outcome.refused]
    rows = []
    for name in next(iter(accepted), {}):
        found = [constants[name] for constants in accepted]
        errors = [100.0 * abs(each.error) for each in found]
        bound = f"{100.0 * family.bounds[name]:g}" if name in family.bounds else ""
        inside, identifiable = (sum(getattr(each, count) for each in found) for count in ("inside", "identifiable"))
        rows.append(
            (
                name,
                f"{inside} of {len(found)} ({100.0 * inside / len(found):.0f} %)",
                f"{identifiable} of {len(found)}",
                *(f"{percentile(errors, share):.2f}" for share in (0.5, 0.95, 1.0)),
                bound,
            )
        )
    header = ("constant", "truth in the 95 % interval", "identifiable", "median", "95th percentile", "worst", "bound")
    print_table(stream, f"Absolute errors in %, of {len(accepted)} accepted recordings", header, rows)
    within = sum(_within(outcome, family) for outcome in outcomes)
    print(
        f"  within the bounds: {within} of {len(outcomes)}; refused: {len(outcomes) - len(accepted)}; CPU of a fit: "
        f"mean {fmean(outcome.cpu_s for outcome in outcomes):.1f} s, "
        f"maximum {max(outcome.cpu_s for outcome in outcomes):.1f} s",
        file=stream,
        flush=True,
    )


def _within(outcome: Outcome, family: Family) -> bool:
    return not outcome.refused and all(
        abs(outcome.constants[name].error) <= bound for name, bound in family.bounds.items()
    )


def _recorded(config: Path, seed: int, pty: bool) -> WireRecording:
    if not pty:
        return _record_over(f"emulator://?config={config}&seed={seed}")
    command = own_program("emulator", "--pty", "--config", str(config), "--seed", str(seed))
    with subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True, env=own_environment()
    ) as table:
        assert table.stdout
        try:
            return _record_over(table.stdout.readline().strip())
        finally:
            table.terminate()


def _record_over(port: str) -> WireRecording:
    bursts = excitation(_DURATION_S, _SPEED_DEG_S, _ACCELERATION_DEG_S2, seed=0)
    with TableClient.open(port, baud=_BAUD) as client:
        return record(client, bursts, _SPEED_DEG_S, _BAUD)


def _identified(known: Path, truth: Path, recording: WireRecording) -> Outcome:
    """Return the result of a fit in which only some of the constants are known."""
    assumed, true = load_config(known), load_config(truth)
    begin_s = time.process_time()
    refused, constants = "", {}
    try:
        check_recording(assumed, recording)
        identified = identify(assumed, recording)
        constants = {constant.name: constant for constant in identified.constants}
        check_fit(identified)
    except RecordingError as error:
        refused = f"refused: {error}"
    cpu_s = time.process_time() - begin_s
    found = {}
    for name, _, function in DERIVED:
        if name in constants:
            estimate, value = constants[name], function(true)
            found[name] = Found(
                estimate.value / value - 1.0, estimate.low <= value <= estimate.high, estimate.identifiable
            )
    return Outcome(found, cpu_s, refused)
