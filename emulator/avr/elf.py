"""The parts of an ELF file that a simulator needs: what goes into the flash, and where the variables are."""

import struct
from typing import NamedTuple

DATA_SPACE = 0x800000
"""Where avr-gcc puts the addresses of the data space; the flash begins at 0."""

_HEADER = struct.Struct("<16sHHIIIIIHHHHHH")
_SEGMENT = struct.Struct("<IIIIIIII")
_SECTION = struct.Struct("<IIIIIIIIII")
_SYMBOL = struct.Struct("<IIIBBH")
_AVR = 83
_MOST_FLASH = 1 << 17
_LOADED = 1
_SYMBOL_TABLE = 2


class ElfError(ValueError):
    """The file is not an ELF file for an AVR controller. The message states the reason."""


class Program(NamedTuple):
    """A program as a debugger sees it."""

    flash: bytes
    symbols: dict[str, int]  # addresses; those of variables from `DATA_SPACE` on


def read_program(data: bytes) -> Program:
    """Return the program in an ELF file.

    Raises:
        ElfError: it is none for this controller.
    """
    try:
        return _program(data)
    except (struct.error, IndexError, UnicodeDecodeError) as error:
        raise ElfError(f"a damaged ELF file: {error}") from error


def _program(data: bytes) -> Program:
    identity, _, machine, _, _, segments_at, sections_at, _, _, segment_size, segments, section_size, sections, _ = (
        _HEADER.unpack_from(data)
    )
    if identity[:6] != b"\x7fELF\x01\x01" or machine != _AVR:
        raise ElfError("not an ELF file for an AVR controller")
    flash = bytearray()
    for index in range(segments):
        kind, offset, _, address, size, *_ = _SEGMENT.unpack_from(data, segments_at + index * segment_size)
        if kind == _LOADED and size and address < DATA_SPACE:
            if address + size > _MOST_FLASH or offset + size > len(data):
                raise ElfError("its program does not fit a controller")
            flash.extend(b"\xff" * (address + size - len(flash)))
            flash[address : address + size] = data[offset : offset + size]
    headers = [_SECTION.unpack_from(data, sections_at + index * section_size) for index in range(sections)]
    symbols: dict[str, int] = {}
    for header in headers:
        if header[1] == _SYMBOL_TABLE:
            symbols |= _symbols(data, header[4], header[5], headers[header[6]][4])
    return Program(bytes(flash), symbols)


def _symbols(data: bytes, offset: int, size: int, names_at: int) -> dict[str, int]:
    symbols = {}
    for place in range(offset, offset + size, _SYMBOL.size):
        name_at, value, _, _, _, _ = _SYMBOL.unpack_from(data, place)
        end = data.find(b"\0", names_at + name_at)
        if end < 0:
            raise ElfError("a damaged ELF file: a name without an end")
        name = data[names_at + name_at : end].decode("ascii")
        symbols[name] = value
    return symbols
