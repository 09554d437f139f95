"""The compiled firmware beside the emulator: what is equal, and what it costs the controller and this machine."""

import json
import time
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, TextIO

from hypothesis import HealthCheck, given, settings

from emulator.avr.compiled_table import CompiledTable
from emulator.avr.toolchain import build_firmware
from emulator.config.table_config import TableConfig, load_config
from protocol.conformance.__main__ import main as conformance
from protocol.conformance.results.record import RecordedCase, read_record
from protocol.conformance.results.replay_check import Misfit, check
from tools.bench.timing import print_table
from tools.firmware import FLASH_BYTES, RAM_BYTES, sizes
from tools.firmware_fuzz import Sent, check_stream, streams
from tools.firmware_mutants import PROFILE, compiled_profile
from tools.lockstep import TABLES, configured, run_edges, run_lockstep

_PIECE_TICKS = 100_000
_EDGES_S = (30_000, 40_000)
_MOST_LINES = 30
_FLOODS = {"2.3/2", "2.3/3"}


def bench(stream: TextIO, ticks: int, lines: int, seed: int) -> None:
    """Print every figure of the compiled firmware.

    Raises:
        PartingError: it is not the emulator's equal.
    """
    _bench_size(stream)
    _bench_speed(stream)
    _bench_edges(stream)
    _bench_conformance(stream)
    _bench_fuzz(stream, lines)
    _bench_lockstep(stream, ticks, seed)


def _bench_size(stream: TextIO) -> None:
    rows = []
    for name in TABLES:
        config = configured(name)
        flash, ram = sizes(build_firmware(config))
        ram += run_edges(config, 300).stack_bytes
        rows.append((name, f"{flash} ({flash / FLASH_BYTES:.0%})", f"{ram} ({ram / RAM_BYTES:.0%})"))
    print_table(stream, "Size in bytes, with the stack", ("table", "flash", "RAM"), rows)


def _bench_speed(stream: TextIO) -> None:
    moving, resting = CompiledTable(load_config()), CompiledTable(load_config())
    moving.receive(b"S 40\rA 100\rR 4000\r")
    moving.advance(3000)
    resting.advance(500)
    rows = [
        (name, f"{ticks / 1000 / _cpu_s(table, ticks):,.0f} x")
        for name, table, ticks in (("in motion at 40 deg/s", moving, 50_000), ("at rest", resting, 500_000))
    ]
    print_table(stream, "Speed of the simulation, one core", ("table", "real time"), rows)


def _cpu_s(table: CompiledTable, ticks: int) -> float:
    start = time.process_time()
    table.advance(ticks)
    return time.process_time() - start


def _bench_edges(stream: TextIO) -> None:
    rows = []
    for name in TABLES:
        for edges_s in _EDGES_S:
            chip = run_edges(configured(name), 10_000, edges_s)
            rows.append((name, f"{edges_s}", f"{chip.lost_edges}", f"{chip.overrun_bytes}", f"{chip.longest_tick}"))
    header = ("table", "edges/s, both ways", "lost", "bytes lost", "longest tick, cycles")
    print_table(stream, "Encoder edges at any cycle, braking, the line busy", header, rows)


def _bench_conformance(stream: TextIO) -> None:
    """Run the suite on both, twice on the compiled firmware, and replay each record on the other."""
    rows: list[tuple[str, ...]] = []
    with TemporaryDirectory() as folder:
        records = {}
        for name, url in (("first", "compiled://"), ("second", "compiled://"), ("emulator", "emulator://")):
            start = time.process_time()
            conformance([f"--port={url}", f"--profile={PROFILE}", f"--out={folder}/{name}"])
            records[name] = Path(folder) / name / "record.json"
            verdicts = json.loads(records[name].read_text(encoding="utf-8"))["verdicts"]
            rows.append((f"suite on {url}", f"{verdicts}", f"{time.process_time() - start:.1f} s"))
        equal = records["first"].read_bytes() == records["second"].read_bytes()
        rows.append(("both records of compiled://", "equal" if equal else "DIFFERENT", ""))
        for name, url in (("first", "emulator://"), ("emulator", "compiled://")):
            options = _replayable(records[name])
            status = conformance([f"--port={url}", f"--profile={PROFILE}", f"--replay={records[name]}", *options])
            rows.append(
                (
                    f"record of the other replayed on {url}",
                    f"{len(options)} cases, {'0 differ' if status == 0 else 'SOME DIFFER'}",
                    "",
                )
            )
    print_table(stream, "Conformance", ("run", "result", "CPU"), rows)


def _replayable(record_file: Path) -> list[str]:
    """Return options for the cases of a record that can be sent again with the same answers.

    Left out are those whose lines leave it open how a table moves; those that read a latch which one of them set; and
    those that flood the receive buffer: which bytes are lost depends on where within a tick a reply begins.
    """
    record, profile = read_record(record_file), compiled_profile()
    options = []
    is_latch_another = False
    for case in (case for case in record.cases if case.wire):
        is_open = isinstance(check((case,), record.home_deg, profile), Misfit)
        triggers = any(event.direction == "beside" for event in case.wire)
        if is_open or case.id in _FLOODS or (is_latch_another and _reads_latch_first(case)):
            is_latch_another |= triggers
        else:
            is_latch_another &= not triggers
            options.append(f"--case={case.id}$")
    return options


def _reads_latch_first(case: RecordedCase) -> bool:
    """Return whether a case reads the latch before it sets it."""
    for event in case.wire:
        if event.direction == "beside":
            return False
        if event.direction == "sent" and b"L" in event.data:
            return True
    return False


def _bench_fuzz(stream: TextIO, lines: int) -> None:
    rows = []
    for name in TABLES:
        config, start = configured(name), time.process_time()
        sent = _fuzzed(config, lines // len(TABLES))
        rows.append((name, f"{sent:,}", "0", f"{time.process_time() - start:.0f} s"))
    print_table(stream, "Fuzzing by hypothesis", ("table", "lines", "differing", "CPU"), rows)


def _fuzzed(config: TableConfig, lines: int) -> int:
    """Send so many lines, at least, and return their number."""
    sent = 0

    @settings(
        max_examples=lines, deadline=None, database=None, derandomize=True, suppress_health_check=list(HealthCheck)
    )
    @given(streams(config, _MOST_LINES))
    def fuzz(stream: list[Sent]) -> None:
        nonlocal sent
        if sent < lines:
            sent += check_stream(config, stream)

    fuzz()
    return sent


def _bench_lockstep(stream: TextIO, ticks: int, seed: int) -> None:
    rows: list[tuple[Any, ...]] = []
    for name in TABLES:
        config, start = configured(name), time.process_time()
        done = [
            run_lockstep(config, min(_PIECE_TICKS, ticks // len(TABLES)), seed + piece)
            for piece in range(max(1, ticks // len(TABLES) // _PIECE_TICKS))
        ]
        row = (sum(one.ticks for one in done), sum(one.lines for one in done), sum(one.motions for one in done))
        longest = max(one.longest_tick for one in done)
        rows.append((name, *(f"{value:,}" for value in row), "0", f"{longest}", f"{time.process_time() - start:.0f} s"))
    header = ("table", "ticks", "lines", "motions", "duties differing", "longest tick, cycles", "CPU")
    print_table(stream, "Lockstep with the emulator", header, rows)
