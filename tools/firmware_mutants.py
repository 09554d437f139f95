"""Faults planted in the firmware's source: does what must find each of them find it?

`python -m tools.firmware_mutants` builds the firmware with each of the mutants of `firmware_mutants.toml` and runs the
check that is named there. It ends with status 1 when one comes through.
"""

import argparse
import sys
import tomllib
from collections.abc import Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import NamedTuple

from emulator.avr.errors import ChipError, ToolchainError
from emulator.avr.toolchain import FIRMWARE, build_firmware, lacking
from emulator.config.table_config import load_config
from protocol.conformance.bench.stand import InProcess
from protocol.conformance.bench.wire import RecordedPort
from protocol.conformance.cases.catalog import chosen_cases
from protocol.conformance.judgement.verdict import Verdict
from protocol.conformance.profile.profile import Profile, load_profile
from protocol.conformance.session.suite import Session, SessionError
from protocol.program.command_line import Parser, program_name
from protocol.program.ending import ended
from tools.lockstep import PartingError, run_edges, run_lockstep, run_phases

MUTANTS = Path(__file__).with_name("firmware_mutants.toml")
PROFILE = FIRMWARE.with_name("profile.toml")
_LOCKSTEP_TICKS = 30_000
_EDGE_TICKS = 400
_SEED = 2


class Mutant(NamedTuple):
    """A fault of the source, and what finds it: `lockstep`, `edges`, `phases`, or the beginning of a case's id."""

    name: str
    file: str
    old: str
    new: str
    found_by: str


def mutants() -> list[Mutant]:
    """Return the mutants of the file."""
    return [Mutant(**entry) for entry in tomllib.loads(MUTANTS.read_text(encoding="utf-8"))["mutant"]]


def finding_on(mutant: Mutant) -> str:
    """Plant a mutant, and return what its check finds, or nothing.

    Raises:
        ToolchainError: it cannot be built.
        ValueError: the source does not have its text, or has it twice.
    """
    with TemporaryDirectory() as folder:
        for source in FIRMWARE.glob("*.[ch]"):
            text = source.read_text(encoding="ascii")
            if source.name == mutant.file:
                if text.count(mutant.old) != 1:
                    raise ValueError(f"{mutant.file} has {text.count(mutant.old)} times {mutant.old!r}; once is wanted")
                text = text.replace(mutant.old, mutant.new)
            (Path(folder) / source.name).write_text(text, encoding="ascii")
        firmware = build_firmware(load_config(), Path(folder))
    try:
        return _found(mutant.found_by, firmware)
    finally:
        firmware.unlink()


def _found(check: str, firmware: Path) -> str:
    try:
        if check == "lockstep":
            run_lockstep(load_config(), _LOCKSTEP_TICKS, _SEED, firmware)
        elif check == "phases":
            run_phases(load_config(), firmware)
        elif check == "edges":
            run_edges(load_config(), _EDGE_TICKS, firmware=firmware)
        else:
            return failing_case(f"compiled://?firmware={firmware}", [check])
    except (PartingError, ChipError) as error:
        return str(error)
    return ""


def compiled_profile() -> Profile:
    """Return the profile of the compiled table: its line does not show that the client has gone."""
    return load_profile(PROFILE)


def failing_case(url: str, prefixes: Sequence[str]) -> str:
    """Run cases on the compiled firmware, and return which fails first and how, or nothing if all pass."""
    from emulator.protocol_compiled import Serial  # noqa: PLC0415  # what builds the simulator is imported when it is run

    try:
        port = Serial(url, timeout=1)
        session = Session(RecordedPort(port), compiled_profile(), InProcess(port.table), seed=0)
        for case in sorted(chosen_cases(prefixes), key=lambda case: case.travel_deg):
            outcome = session.run_case(case)
            if outcome.verdict in {Verdict.FAIL, Verdict.ERROR}:
                return f"{case.id}: {outcome.reason}"
    except (SessionError, ChipError) as error:
        return str(error)
    return ""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run all mutants; return 1 when one comes through."""
    parser = Parser(prog=program_name("tools.firmware_mutants"), description="Plant faults in the compiled firmware.")
    parser.add_argument("name", nargs="*", help="only mutants whose name contains it")
    options = parser.parse_args(arguments)
    return ended("firmware_mutants", lambda: _run(options), ToolchainError)


def _run(options: argparse.Namespace) -> int:
    if reason := lacking():
        raise ToolchainError(reason)
    missed = 0
    for mutant in mutants():
        if options.name and not any(name in mutant.name for name in options.name):
            continue
        finding = finding_on(mutant)
        missed += not finding
        print(f"{'found' if finding else 'MISSED':7} {mutant.name} ({mutant.found_by}): {finding[:150]}", flush=True)
    return int(missed > 0)


if __name__ == "__main__":
    sys.exit(main())
