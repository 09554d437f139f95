"""The accuracy of the constants that a minute over the wire gives, for tables that the fit does not know.

python -m tools.bench identify          ten random tables over emulator://
python -m tools.bench identify --wide   40 of a family twice as wide, and the default table with seeds 0 to 19
python -m tools.bench identify --pty    ten random tables over pseudo-terminals, in real time
"""

import subprocess
import sys
import tempfile
import time
from collections.abc import Iterable
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from pathlib import Path
from typing import NamedTuple, TextIO

import emulator  # noqa: F401  # teaches pyserial the port emulator://
from emulator.config.table_config import load_config
from protocol.client import TableClient
from tools.bench.identify_tables import DEFAULT, NARROW, WIDE, Family, write_constants
from tools.bench.timing import print_table
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


class Found(NamedTuple):
    """One estimate against the truth."""

    error: float
    inside: bool  # the truth is in the 95 % interval
    identifiable: bool


class Outcome(NamedTuple):
    """A fit: its estimates, the CPU time it took, and why it was refused, if it was."""

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


def _bench(stream: TextIO, family: Family, seeds: Iterable[int], jobs: int, pty: bool) -> None:
    with tempfile.TemporaryDirectory() as name, ProcessPoolExecutor(jobs) as workers:
        folder = Path(name)
        tables = [family.table(each) for each in seeds]
        known = [
            write_constants(folder / f"{each}.known.toml", table.known)
            for each, table in zip(seeds, tables, strict=True)
        ]
        truth = [
            write_constants(folder / f"{each}.toml", table.known | table.hidden)
            for each, table in zip(seeds, tables, strict=True)
        ]
        recordings = list(workers.map(partial(_recorded, pty=pty), truth, seeds))
        # Fitted only now: it keeps the cores busy, which would disturb a recording.
        outcomes = list(workers.map(_identified, known, truth, recordings))
        backlashes = [load_config(path).gears.backlash_arcmin for path in truth]
    line = "pseudo-terminals in real time" if pty else "emulator://"
    names = [name for name, _, _ in DERIVED]
    print_table(
        stream,
        f"Errors in % for {family.title}, {_DURATION_S:g} s over {line}; * the truth is outside the 95 % interval",
        ("seed, backlash", *names, "CPU, s", "within bounds"),
        [
            (
                f"{seed}, {backlash:.1f} arcmin",
                *(f"{100.0 * found.error:+.1f}{'' if found.inside else ' *'}" for found in outcome.constants.values()),
                f"{outcome.cpu_s:.0f}",
                outcome.refused or ("yes" if _within(outcome, family) else "NO"),
            )
            for seed, backlash, outcome in zip(seeds, backlashes, outcomes, strict=True)
        ],
    )
    accepted = [outcome.constants for outcome in outcomes if not outcome.refused]
    for title, count in (("truth inside the 95 % interval", "inside"), ("identifiable", "identifiable")):
        shares = [f"{name} {sum(getattr(found[name], count) for found in accepted)}" for name in names]
        print(f"  {title}, of {len(accepted)} accepted: {', '.join(shares)}", file=stream)
    bounds = ", ".join(f"{name} {100.0 * bound:g} %" for name, bound in family.bounds.items())
    within = sum(_within(outcome, family) for outcome in outcomes)
    print(f"  within bounds ({bounds}): {within} of {len(outcomes)}", file=stream, flush=True)


def _within(outcome: Outcome, family: Family) -> bool:
    return not outcome.refused and all(
        abs(outcome.constants[name].error) <= bound for name, bound in family.bounds.items()
    )


def _recorded(config: Path, seed: int, pty: bool) -> WireRecording:
    if not pty:
        return _record_over(f"emulator://?config={config}&seed={seed}")
    command = [sys.executable, "-m", "emulator", "--pty", "--config", str(config), "--seed", str(seed)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True) as table:
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
    """Return what a fit that knows only a part of the constants makes of a recording."""
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
