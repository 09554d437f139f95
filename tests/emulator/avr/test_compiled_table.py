"""The compiled firmware behind the surface of a table."""

from dataclasses import replace
from functools import partial
from pathlib import Path

import pytest

from emulator.avr.compiled_table import AnyTable, CompiledTable
from emulator.avr.errors import ToolchainError
from emulator.avr.toolchain import build_firmware
from emulator.config.table_config import load_config
from emulator.faults.fault import FaultError, fault_from
from emulator.table.table import Table
from protocol.bench import SimulatedBench, TableStatus
from tests.emulator.avr.toolchain_mark import needs_toolchain

pytestmark = needs_toolchain


def moved(table: Table | CompiledTable) -> bytes:
    table.receive(b"R 2\rH\r")
    table.advance(800)
    table.set_load_torque(0.5)
    table.receive(b"H\rL\r")
    table.advance(100)
    return table.transmit()


def observe(statuses: list[TableStatus], status: TableStatus, _read: bytes, _left: bytes) -> None:
    statuses.append(status)


def test_it_is_a_bench_in_simulated_time() -> None:
    assert isinstance(CompiledTable(load_config()), SimulatedBench)


def test_status_and_replies_are_those_of_the_emulator() -> None:
    ours, theirs = Table(load_config(), seed=7), CompiledTable(load_config(), seed=7)
    assert moved(ours) == moved(theirs)
    assert ours.status() == theirs.status()


def test_the_same_inputs_give_the_same_outputs() -> None:
    first, second = (CompiledTable(load_config(), seed=5) for _ in range(2))
    assert moved(first) == moved(second)
    assert first.chip.longest_tick == second.chip.longest_tick
    assert first.controller() == second.controller()


def test_an_observer_sees_every_tick_as_on_the_emulator() -> None:
    seen: list[list[TableStatus]] = [[], []]
    tables: tuple[AnyTable, ...] = (Table(load_config()), CompiledTable(load_config()))
    for table, statuses in zip(tables, seen, strict=True):
        table.observer = partial(observe, statuses)
        table.receive(b"R 1\r")
        table.advance(400)
    ours, theirs = ([(one.tick, one.duty, one.state, one.reference_deg) for one in statuses] for statuses in seen)
    assert ours == theirs
    assert len(ours) == 400


def test_a_power_cycle_leaves_the_plant_where_it_is_and_the_counter_at_0() -> None:
    table = CompiledTable(load_config())
    moved(table)
    turned_deg = table.status().true_deg
    table.reset()
    assert table.status().encoder_deg == table.status().latched_deg == 0
    table.receive(b"H\r")
    table.advance(20)
    assert table.transmit() == b"H 0.0\r"
    assert abs(turned_deg) > 0.5


def test_faults_of_the_emulator_are_refused() -> None:
    fault = fault_from("stall", {})
    with pytest.raises(FaultError, match="stall has no effect on the compiled firmware"):
        CompiledTable(load_config()).inject(fault)
    with pytest.raises(FaultError, match="stall"):
        CompiledTable(replace(load_config(), faults=(fault,)))


def test_a_firmware_for_another_table_is_refused() -> None:
    firmware = build_firmware(load_config().with_serial(decimals=2))
    with pytest.raises(ToolchainError, match="was built for another table"):
        CompiledTable(load_config(), firmware=firmware)


def test_a_file_that_is_no_firmware_is_refused(tmp_path: Path) -> None:
    with pytest.raises(ToolchainError, match="is not this firmware"):
        CompiledTable(load_config(), firmware=Path(__file__))
    with pytest.raises(ToolchainError, match="No such file"):
        CompiledTable(load_config(), firmware=tmp_path / "none.elf")


@pytest.mark.parametrize("fraction", [-0.1, 1.0])
def test_an_edge_outside_of_the_coming_tick_is_misuse(fraction: float) -> None:
    with pytest.raises(ValueError, match=r"outside 0\.\.1"):
        CompiledTable(load_config()).trigger(fraction)
