"""Random mutations of the emulated table that the conformance suite does not find.

`python -m tools.mutants --seed N --count N` changes one operator, constant, condition or statement of the table's code
at a time, in memory. It runs the suite against that table until a case fails. It prints mutants that pass. Those that
may pass are listed with the reason in `mutants.toml`.
"""

import protocol.program.quiet_start  # noqa: F401 - before the slow imports

# isort: split
import argparse
import json
import resource
import subprocess
import sys
import tomllib
from collections.abc import Iterator, Sequence
from pathlib import Path
from random import Random
from typing import NamedTuple

from emulator.table.fast_ticks import LOADED_TICKS
from protocol.program.command_line import Parser, program_name
from protocol.program.ending import ended
from protocol.program.own_program import own_environment, own_program
from protocol.program.progress import share_shown
from tools.mutation import COMPILED, MODULES, Mutation, mutations_of, planted

EXPLAINED = Path(__file__).with_name("mutants.toml")
_CPU_S = 60
"""Maximum computing time of a mutant; a whole run takes about 15 s."""


class Explanation(NamedTuple):
    """Reason why mutants may survive: all of a function or class, or only changes with some text."""

    where: str
    change: str
    reason: str

    def holds_for(self, mutation: Mutation) -> bool:
        """Return whether it applies to a mutation: in this function or class, and with this text in its change."""
        return f"{mutation.where}.".startswith(f"{self.where}.") and self.change in mutation.change


def explanations(file: Path = EXPLAINED) -> list[Explanation]:
    """Return the content of the file of mutants that may survive."""
    entries = tomllib.loads(file.read_text(encoding="utf-8"))["may"]
    return [Explanation(entry["where"], entry.get("change", ""), entry["reason"]) for entry in entries]


def verdict_on(mutation: Mutation, seed: int) -> str:
    """Apply a mutation in this process, and return which case fails and how, or nothing if all pass."""
    from emulator.protocol_emulator import RUN, Serial  # noqa: PLC0415 - the mutation is applied to the loaded modules
    from protocol.conformance.bench.stand import InProcess  # noqa: PLC0415
    from protocol.conformance.bench.wire import RecordedPort  # noqa: PLC0415
    from protocol.conformance.cases.catalog import all_cases  # noqa: PLC0415
    from protocol.conformance.judgement.verdict import Verdict  # noqa: PLC0415
    from protocol.conformance.profile.profile import load_profile  # noqa: PLC0415
    from protocol.conformance.session.suite import Session, SessionError  # noqa: PLC0415

    # Compiled code is that of the table without the mutation.
    RUN.warm_up_ticks = sys.maxsize if mutation.module in COMPILED else LOADED_TICKS
    planted(mutation)
    try:
        port = Serial("emulator://", timeout=1)
        session = Session(RecordedPort(port), load_profile(), InProcess(port.table), seed)
        for case in sorted(all_cases(), key=lambda case: case.travel_deg):  # the fast ones first
            outcome = session.run_case(case)
            if outcome.verdict in {Verdict.FAIL, Verdict.ERROR}:
                return f"{case.id}: {outcome.reason}"
    except SessionError as error:
        return f"no session: {error}"
    except Exception as error:
        return f"{type(error).__name__}: {error}"
    return ""


def verdict_in_a_process(index: int, seed: int) -> str:
    """Return the verdict on a mutation from a separate process, because it may hang or crash."""
    command = own_program("tools.mutants", "--only", str(index), "--seed", str(seed))
    done = subprocess.run(command, capture_output=True, text=True, check=False, env=own_environment())
    if done.returncode:
        return f"status {done.returncode}: {done.stderr.strip().splitlines()[-1:]}"
    return str(json.loads(done.stdout))


def hunt(count: int, seed: int) -> Iterator[tuple[Mutation, str]]:
    """Yield random mutations, each with the result of the suite: nothing if it survived."""
    mutations = list(enumerate(mutations_of(MODULES)))
    chosen = Random(seed).sample(mutations, min(count, len(mutations)))  # noqa: S311 - not for security
    with share_shown("mutants") as progress:
        for number, (index, mutation) in enumerate(chosen):
            progress(number / len(chosen))
            yield mutation, verdict_in_a_process(index, seed)


def _run(options: argparse.Namespace) -> int:
    if options.only is not None:
        resource.setrlimit(resource.RLIMIT_CPU, (_CPU_S, _CPU_S))
        print(json.dumps(verdict_on(mutations_of(MODULES)[options.only], options.seed)))
        return 0
    known = explanations()
    caught = explained = 0
    unexplained: list[Mutation] = []
    try:
        for mutation, verdict in hunt(options.count, options.seed):
            reason = next((one.reason for one in known if one.holds_for(mutation)), "")
            if verdict:
                caught += 1
            elif reason:
                explained += 1
            else:
                unexplained.append(mutation)
            if options.all or not (verdict or reason):
                print(f"{mutation}: {verdict[:160] or reason or 'SURVIVED'}", flush=True)
    finally:
        print(f"{caught} caught, {explained} survived with a reason, {len(unexplained)} survived")
    return int(bool(unexplained))


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line, and return the exit status: 1 if a mutant survived without a reason."""
    asked = parser()
    options = asked.parse_args(arguments)
    if options.count < 1:
        asked.error(f"--count {options.count}: must be 1 or more")
    return ended("mutants", lambda: _run(options))


def parser() -> Parser:
    """Return the parser of the command line."""
    parser = Parser(
        prog=program_name("tools.mutants"),
        description="Plant random faults in the emulated table; print those that the conformance suite misses.",
    )
    parser.add_argument("--seed", type=int, default=0, help="random seed of the mutants and of the suite (default: 0)")
    parser.add_argument("--count", type=int, default=60, help="number of mutants, about 5 s each (default: 60)")
    parser.add_argument("--all", action="store_true", help="print caught mutants too, each with its case")
    parser.add_argument("--only", type=int, metavar="INDEX", help=argparse.SUPPRESS)
    return parser


if __name__ == "__main__":
    sys.exit(main())
