"""Long runs of the emulator, each with its invariants: `python -m tools.soak noise day year clients wrap`.

The tests run each soak at a small size; here it has its full size.
"""

import protocol.program.quiet_start  # noqa: F401 - before the slow imports

# isort: split
import argparse
import resource
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from random import Random
from typing import NamedTuple

from emulator.config.table_config import load_config
from emulator.table.fast_ticks import FastTicks
from emulator.table.table import Table
from protocol.client import TableClient
from protocol.codec import decode_reply
from protocol.errors import TableError
from protocol.messages import Angle, Ok, Refusal
from protocol.program.command_line import Parser, program_name
from protocol.program.ending import ended
from protocol.program.own_program import own_environment, own_program

_TICK_HZ = 1000


class Soak(NamedTuple):
    """The result of a soak: named figures, and failures."""

    figures: dict[str, str]
    faults: list[str]


def soak_noise(size: float, seed: int) -> Soak:
    """Send random bytes in pieces of random size. All replies must be in order, and the table must not move.

    Random bytes sometimes contain `P5` or `R-3`: those letters are removed, so that nothing commands a motion.
    """
    chance = Random(seed)  # noqa: S311 - not for security
    table = Table(load_config().with_serial(baud=0), seed)
    alphabet = bytes(byte for byte in range(256) if byte not in b"PR")
    before = table.status().encoder_deg
    sent = replies = refusals = 0
    strange: list[str] = []
    while sent < round(size):
        piece = bytes(
            chance.choices(
                alphabet + b"\r" * 20 + b"HLSA 0123456789.-+" * 4, k=min(chance.randint(1, 4000), round(size) - sent)
            )
        )
        sent += len(piece)
        table.receive(piece)
        for line in table.transmit().split(b"\r")[:-1]:
            replies += 1
            reply = decode_reply(line)
            refusals += isinstance(reply, Refusal)
            if isinstance(reply, Angle) and reply.angle_deg != 0:
                strange.append(f"{line!r} from a table that rests at 0")
        table.receive(b"\r")
        table.transmit()
        table.receive(b"H\rL\rS 10\r")
        got = [decode_reply(line) for line in table.transmit().split(b"\r")[:-1]]
        if [type(reply) for reply in got] != [Angle, Angle, Ok]:
            strange.append(f"after {sent} bytes 'H', 'L', 'S 10' got {got}")
        table.advance(chance.randint(0, 50))
    moved = table.status().encoder_deg - before
    faults = strange[:5] + ([f"the table moved by {moved} deg"] if moved else [])
    return Soak({"bytes": f"{sent:,}", "replies": f"{replies:,}", "refused": f"{refusals:,}"}, faults)


def soak_day(hours: float, seed: int) -> Soak:
    """Run random commands for simulated hours, most of them in motion; see `_soak_motions`."""
    return _soak_motions(hours, seed, pauses_ticks=(20, 200, 2000, 20_000, 100_000))


def soak_year(days: float, seed: int) -> Soak:
    """Run random commands for simulated days, mostly at rest, about thirty a day; see `_soak_motions`."""
    return _soak_motions(24 * days, seed, pauses_ticks=(200, 20_000, 200_000, 3_600_000, 10_000_000))


def _soak_motions(hours: float, seed: int, pauses_ticks: Sequence[int]) -> Soak:
    """Run random commands for simulated hours: memory must not grow, and count and true angle must not drift apart."""
    chance = Random(seed)  # noqa: S311 - not for security
    config = load_config()
    table = Table(config, seed, run=FastTicks())
    half_gap_deg = config.gears.backlash_arcmin / 60 / 2
    end, commands, worst_deg = round(hours * 3600 * _TICK_HZ), 0, 0.0
    sizes_kB: list[int] = []
    while table.tick < end:
        table.receive(_random_command(chance))
        commands += 1
        table.advance(min(chance.choice(pauses_ticks), end - table.tick))
        table.transmit()
        status = table.status()
        worst_deg = max(worst_deg, abs(status.encoder_deg - status.true_deg))
        if commands % 100 == 0:
            sizes_kB.append(_memory_kB())
    # The resolution of the encoder, and the initial position of the shaft between two counts, add to the gap.
    allowed_deg = 2 * half_gap_deg + 2 / config.counts_per_deg
    growth_kB = sizes_kB[-1] - sizes_kB[len(sizes_kB) // 4] if sizes_kB else 0  # after the first quarter
    figures = {
        "simulated": f"{table.tick / _TICK_HZ / 3600:.1f} h",
        "commands": f"{commands:,}",
        "count from true angle": f"{worst_deg:.4f} deg (backlash {2 * half_gap_deg:.4f})",
        "memory growth": f"{growth_kB} kB",
    }
    faults = [] if worst_deg <= allowed_deg else [f"count and true angle are {worst_deg:.3f} deg apart"]
    return Soak(figures, faults + ([f"memory grew by {growth_kB} kB"] if growth_kB > 1024 else []))


def soak_clients(count: float, seed: int) -> Soak:
    """Connect and disconnect clients on a pty, some of them within a line. Each must have its replies."""
    chance = Random(seed)  # noqa: S311 - not for security
    faults: list[str] = []
    with tempfile.TemporaryDirectory() as folder, _emulator(Path(folder) / "table") as (link, process):
        descriptors = _descriptors(process)
        for index in range(round(count)):
            try:
                with TableClient.open(link, timeout_s=2.0) as client:
                    position = client.position_deg()
            except TableError as error:
                faults.append(f"client {index}: {error}")
                continue
            if position != 0.0:
                faults.append(f"client {index} read {position} deg")
            if chance.random() < 0.5:
                with Path(link).open("wb", buffering=0) as half:
                    half.write(chance.choice((b"R 5", b"P", b"H", b"S 1")))
        leaked = _descriptors(process) - descriptors
    if leaked:
        faults.append(f"{leaked} descriptors were left open")
    return Soak({"clients": f"{round(count):,}", "open descriptors left": str(leaked)}, faults)


def soak_wrap(count: float, seed: int) -> Soak:
    """Move the counter past its limit in both directions, repeatedly: the motion must continue."""
    config = load_config().with_serial(baud=0)
    table, counts_per_deg = Table(config, seed), config.counts_per_deg
    faults = []
    for index in range(round(count)):
        direction = 1 if index % 2 == 0 else -1
        table.reset(direction * (2**31 - 2000) - (direction < 0))
        start = table.status()
        table.receive(b"S 40\rA 100\rR %d\r" % (20 * direction))
        table.advance(3000)
        status = table.status()
        travelled = status.encoder_deg - start.encoder_deg + direction * 2**32 / counts_per_deg
        turned = status.true_deg - start.true_deg
        if abs(travelled - 20 * direction) > 0.05 or abs(turned - 20 * direction) > 0.3:
            faults.append(f"run {index}: {travelled:.3f} deg counted, {turned:.3f} deg turned, of {20 * direction}")
    return Soak({"wraps": f"{count:g}"}, faults[:5])


SOAKS: dict[str, tuple[Callable[[float, int], Soak], float, str]] = {
    "noise": (soak_noise, 10_000_000, "random bytes"),
    "day": (soak_day, 24.0, "simulated hours of random commands"),
    "year": (soak_year, 365.0, "simulated days of random commands, mostly at rest"),
    "clients": (soak_clients, 1000, "clients that connect and disconnect on a pty"),
    "wrap": (soak_wrap, 100, "runs past the limit of the counter"),
}
"""Each soak by its name: its function, its full size, and the unit of that size."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the named soaks; return 1 if an invariant failed."""
    options = parser().parse_args(arguments)
    return ended("soak", lambda: _run(options))


def parser() -> Parser:
    """Return the parser of the command line."""
    parser = Parser(
        prog=program_name("tools.soak"),
        description="Run the emulator for a long time, and check the invariants.",
        epilog="example: python -m tools.soak noise --share 0.01",
    )
    parser.add_argument("name", nargs="+", choices=SOAKS, help=f"which invariants, of {', '.join(SOAKS)}")
    parser.add_argument("--share", type=float, default=1.0, metavar="X", help="of the full size (default 1)")
    parser.add_argument("--seed", type=int, default=0, metavar="N", help="random seed (default 0)")
    return parser


def _run(options: argparse.Namespace) -> int:
    failed = False
    for name in options.name:
        run, full, unit = SOAKS[name]
        size = full * options.share
        sys.stderr.write(f"soak {name}: {size:g} {unit}\n")
        soak = run(size, options.seed)
        failed = failed or bool(soak.faults)
        print(f"{name}: " + ", ".join(f"{key} {value}" for key, value in soak.figures.items()))
        for fault in soak.faults:
            print(f"  FAULT: {fault}")
    return int(failed)


def _random_command(chance: Random) -> bytes:
    verb = chance.choice(("P", "R", "R", "S", "A", "H", "L"))
    bounds = {"P": (-3600, 3600), "R": (-200, 200), "S": (20, 400), "A": (50, 1000)}
    if verb not in bounds:
        return f"{verb}\r".encode()
    return f"{verb} {chance.randint(*bounds[verb]) / 10}\r".encode()


def _memory_kB() -> int:
    """Return the memory that this process has in use."""
    pages = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[1])
    return pages * resource.getpagesize() // 1024


def _descriptors(process: "subprocess.Popen[str]") -> int:
    return len(list(Path(f"/proc/{process.pid}/fd").iterdir()))


@contextmanager
def _emulator(link: Path) -> "Iterator[tuple[str, subprocess.Popen[str]]]":
    """Run an emulator on a pty under a link."""
    command = own_program("emulator", "--pty", "--link", str(link), "--baud", "0")
    with subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True, env=own_environment()
    ) as process:
        assert process.stdout is not None
        try:
            process.stdout.readline()
            yield str(link), process
        finally:
            process.terminate()


if __name__ == "__main__":
    sys.exit(main())
