"""Reading a firmware's file: a damaged one is refused, never run."""

import struct
from contextlib import suppress

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from emulator.avr.elf import DATA_SPACE, ElfError, read_program
from emulator.avr.toolchain import build_firmware
from emulator.config.table_config import load_config
from tests.emulator.avr.toolchain_mark import needs_toolchain

HEADER = struct.pack("<16sHHIIIIIHHHHHH", b"\x7fELF\x01\x01", 2, 83, 1, 0, 0, 0, 0, 52, 32, 0, 40, 0, 0)


def test_a_header_alone_is_an_empty_program() -> None:
    assert read_program(HEADER) == (b"", {})


@pytest.mark.parametrize("data", [b"", b"\x7fELF", b"MZ" + HEADER[2:], HEADER[:18] + b"\x03\0" + HEADER[20:]])
def test_another_file_is_refused(data: bytes) -> None:
    with pytest.raises(ElfError):
        read_program(data)


@given(st.data())
def test_a_damaged_file_is_refused_or_read(data: st.DataObject) -> None:
    damaged = bytearray(HEADER + bytes(80))
    for _ in range(data.draw(st.integers(1, 6))):
        damaged[data.draw(st.integers(0, len(damaged) - 1))] = data.draw(st.sampled_from([0, 1, 2, 40, 200, 255]))
    try:
        program = read_program(bytes(damaged))
    except ElfError:
        return
    assert len(program.flash) < 1 << 20


@needs_toolchain
@settings(max_examples=30)
@given(st.data())
def test_a_firmware_that_was_cut_or_damaged_is_refused_or_read(data: st.DataObject) -> None:
    whole = build_firmware(load_config()).read_bytes()
    damaged = bytearray(whole[: data.draw(st.integers(0, len(whole)))])
    for place in data.draw(st.lists(st.integers(0, 51), max_size=3)):
        damaged[place : place + 1] = data.draw(st.binary(min_size=1, max_size=1))
    with suppress(ElfError):
        read_program(bytes(damaged))


def test_a_name_without_an_end_is_refused() -> None:
    symbol_table = struct.pack("<IIIIIIIIII", 0, 2, 0, 0, 132, 16, 1, 0, 0, 0)
    names = struct.pack("<IIIIIIIIII", 0, 3, 0, 0, 148, 4, 0, 0, 0, 0)
    header = HEADER[:32] + struct.pack("<I", 52) + HEADER[36:48] + struct.pack("<HH", 2, 0)
    symbol = struct.pack("<IIIBBH", 0, 0, 0, 0, 0, 0)
    with pytest.raises(ElfError, match="a name without an end"):
        read_program(header + symbol_table + names + symbol + b"main")


@needs_toolchain
def test_flash_and_variables_of_the_firmware_are_found() -> None:
    program = read_program(build_firmware(load_config()).read_bytes())
    assert len(program.flash) < 16 * 1024
    assert program.symbols["main"] < DATA_SPACE < program.symbols["controller"]
