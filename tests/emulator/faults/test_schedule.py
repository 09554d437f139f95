"""The start and the end of faults, and their random seed."""

from pathlib import Path

from emulator.config.table_config import load_config
from emulator.faults.fault import fault_from
from emulator.protocol_emulator import Serial
from emulator.table.table import Table
from tests.emulator.fault_bench import Bench


def test_a_fault_can_wait_for_its_time_and_end(bench: Bench) -> None:
    bench.inject("silence", at_s=2.0, for_s=1.0)
    silent = [not bench.raw(b"H", 0.3) for _ in range(12)]
    begin, end = silent.index(True), len(silent) - silent[::-1].index(True)
    assert all(silent[begin:end])
    assert 3 <= end - begin <= 4


def test_a_fault_can_wait_for_the_nth_command() -> None:
    port = Serial("emulator://", timeout=1)
    port.table.inject(fault_from("half-reply", {"bytes": 1, "at_command": 3}))
    replies = []
    for _ in range(4):
        port.write(b"H\r")
        replies.append(port.read_until(b"\r"))
    assert replies == [b"H 0.0\r", b"H 0.0\r", b"H", b"H 0.0\r"]


def test_faults_of_a_configuration_hold_from_the_start(tmp_path: Path) -> None:
    file = tmp_path / "faulty.toml"
    file.write_text(
        '[[faults]]\nfault = "silence"\nfor_s = 0.5\n\n[[faults]]\nfault = "half-reply"\nbytes = 2\nat_command = 2\n'
    )
    port = Serial(f"emulator://?config={file}", timeout=1)
    port.write(b"H\r")
    assert port.read(10) == b""
    port.write(b"H\r")
    assert port.read(10) == b"H "


def test_a_table_with_faults_repeats_itself_from_its_seed() -> None:
    def run(seed: int) -> bytes:
        table = Table(load_config(), seed)
        table.inject(fault_from("drop", {"probability": 0.3}))
        table.inject(fault_from("lost-counts", {"probability": 0.3}))
        for _ in range(20):
            table.receive(b"R 1\rH\r")
            table.advance(200)
        return table.transmit()

    assert run(1) == run(1) != run(2)


def test_a_snapshot_holds_the_faults_too() -> None:
    table = Table(load_config())
    table.inject(fault_from("lost-counts", {"probability": 0.3, "for_s": 1.0}))
    table.inject(fault_from("stall", {"at_s": 0.8}))
    table.receive(b"P 20\r")
    table.advance(500)
    snapshot = table.snapshot()
    futures = []
    for _ in range(2):
        table.restore(snapshot)
        table.advance(1000)
        futures.append(table.status())
    assert futures[0] == futures[1]
    assert futures[0].state == "stalled"
