"""The compiled firmware beside the emulator: equal duty at every tick, equal replies, in the time that there is."""

import re
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from emulator.avr.compiled_table import CompiledTable
from emulator.avr.toolchain import FIRMWARE, build_firmware
from emulator.config.table_config import load_config
from tests.emulator.avr.toolchain_mark import needs_toolchain
from tools.firmware import FLASH_BYTES, RAM_BYTES, sizes
from tools.firmware_fuzz import check_stream, streams
from tools.lockstep import TABLES, Pair, configured, run_edges, run_lockstep, run_phases

pytestmark = needs_toolchain

PIN = re.compile(r"^ *\| *(P[A-D]\d(?:, P[A-D]\d)?) *\| *([AD]\d(?:, [AD]\d)?) *\|", re.MULTILINE)
MOST_CYCLES = 12_000
"""Of a tick of 16 000."""


@pytest.mark.parametrize("name", TABLES)
def test_the_duty_is_the_emulators_at_every_tick(name: str) -> None:
    done = run_lockstep(configured(name), ticks=12_000, seed=2)
    assert done.motions > 5
    assert done.longest_tick <= MOST_CYCLES


@pytest.mark.parametrize("name", TABLES)
def test_30_000_edges_a_second_are_counted_both_ways_while_the_line_is_busy(name: str) -> None:
    chip = run_edges(configured(name), ticks=600, edges_s=30_000)
    assert (chip.lost_edges, chip.overrun_bytes) == (0, 0)
    assert chip.longest_tick <= MOST_CYCLES


def test_an_edge_at_any_cycle_about_a_tick_is_sampled_whole() -> None:
    run_phases(load_config())


def test_half_of_flash_and_ram_is_free() -> None:
    flash, ram = sizes(build_firmware(load_config()))
    assert flash <= FLASH_BYTES / 2
    assert ram + run_edges(load_config(), ticks=300).stack_bytes <= RAM_BYTES / 2


@pytest.mark.parametrize("name", TABLES)
@settings(max_examples=10, suppress_health_check=[HealthCheck.too_slow])
@given(st.data())
def test_any_bytes_and_triggers_have_the_same_replies_and_duties(name: str, data: st.DataObject) -> None:
    config = configured(name)
    check_stream(config, data.draw(streams(config, most_lines=8)))


@pytest.mark.parametrize(
    "line",
    [
        b"P 4194303.998046875",  # the last position
        b"P 4194303.9990234375",  # half a count more: to the even one, which is out of range
        b"P 0.00000000001455191522836685180664",  # slightly below half of the smallest unit
        b"R 4194304",
        b"R 4194304.00000000000000001",
        b"S 40.0000000000000000000000",
        b"S 40.0000000000000000000001",
        b"S 0.00000001",
        b"A 0.0000145",
        b"P 99999999999999999999999999999",
        b"R -0",
        b"P 00000000000000000000000000001",
    ],
)
def test_a_number_at_a_limit_has_the_same_effect(line: bytes) -> None:
    pair = Pair(load_config(), seed=3)
    for sent in (line, b"R 0.01", b"H"):
        pair.send(sent)
        pair.step(90)
    pair.compare()


@pytest.mark.parametrize("count", [2**31 - 2000, -(2**31) + 2000])
def test_the_counter_runs_over_its_end_as_the_emulators_does(count: int) -> None:
    pair = Pair(load_config(), seed=1)
    pair.emulated.reset(count)
    pair.compiled.reset(count)
    pair.step(30)
    for line in (b"S 40", b"A 100", b"R 8" if count > 0 else b"R -8"):
        pair.send(line)
        pair.step(40)
    pair.step(1500)
    pair.compare()
    assert pair.emulated.status().encoder_deg * count < 0


def test_the_latch_is_within_a_count_of_the_encoder_at_any_share_of_a_tick() -> None:
    table = CompiledTable(load_config())
    table.receive(b"S 40\rA 100\rR 90\r")
    table.advance(700)
    for n in range(40):
        before = table.status().encoder_deg
        table.trigger(share := (n + 0.5) / 40)
        table.advance(1)
        after = table.status()
        instant = before + share * (after.encoder_deg - before)
        assert abs(after.latched_deg - instant) * 512 <= 1.5
    assert after.encoder_deg - before > 10 / 512


def pins_in(file: Path) -> set[tuple[str, str]]:
    """Return the pins in a table of a file, each with its name on an Arduino board."""
    rows = PIN.findall(file.read_text(encoding="utf-8"))
    return {pair for pins, names in rows for pair in zip(pins.split(", "), names.split(", "), strict=True)}


def test_the_page_wires_the_pins_of_the_board() -> None:
    wired = pins_in(Path(__file__).parents[3] / "docs" / "build-a-table.md")
    assert len(wired) == 7
    assert wired == pins_in(FIRMWARE / "board.h")


def planted(folder: Path, file: str, old: str, new: str) -> CompiledTable:
    """Return a table whose firmware has another text in one of its sources."""
    for source in FIRMWARE.glob("*.[ch]"):
        text = source.read_text(encoding="ascii")
        if source.name == file:
            assert text.count(old) == 1
            text = text.replace(old, new)
        (folder / source.name).write_text(text, encoding="ascii")
    return CompiledTable(load_config(), firmware=build_firmware(load_config(), folder))


def test_a_program_that_is_stuck_is_reset_and_the_bridge_is_off(tmp_path: Path) -> None:
    entry = "void controller_step(int32_t count)\n{\n"
    table = planted(tmp_path, "controller.c", entry, f"{entry}    while (count > 300) {{\n    }}\n")
    table.receive(b"R 90\r")
    table.advance(1000)
    assert table.duty == 0
    table.receive(b"H\r")
    table.advance(100)
    assert table.transmit() == b"OK\rH 0.0\r"


def test_a_reply_that_has_left_before_its_interrupt_is_switched_on_is_sent_once(tmp_path: Path) -> None:
    entry = "    ATOMIC_BLOCK(ATOMIC_RESTORESTATE) /* the transmit interrupt"
    wait = "    for (volatile uint32_t n = 10000; n != 0; --n) {\n    }\n"
    table = planted(tmp_path, "line.c", entry, wait + entry)
    table.receive(b"H\rH\r")
    table.advance(300)
    assert table.transmit() == b"H 0.0\rH 0.0\r"
