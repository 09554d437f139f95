"""What a table may take a line for: one of this protocol, and one that reads more than clause 4.1 allows; no I/O."""

import re
from collections.abc import Iterator
from decimal import Decimal, InvalidOperation

from protocol.codec import decode_command
from protocol.messages import LINE_LIMIT, VERBS, Command, ErrorCode, Verb

_LETTERS = {letter: verb for verb in Verb if VERBS[verb].takes_number for letter in (verb.value, verb.value.lower())}
_NUMBER = re.compile(r"[+-]?(?:[0-9]+[.,]?[0-9]*|[.,][0-9]+)(?:[eE][+-]?[0-9]+)?")
_HEXADECIMAL = re.compile(r"0[xX]([0-9a-fA-F]+)")
_PRINTABLE = bytes(range(0x20, 0x7F))
_SIGNS_AND_DIGITS = frozenset("+-0123456789")


def certain_command(line: bytes) -> Command | None:
    """Return what every table of this protocol takes a line for, LF and all; None where it must refuse the line."""
    text = line.replace(b"\n", b"")
    if len(text) > LINE_LIMIT or text.translate(None, _PRINTABLE):
        return None
    command = decode_command(text)
    return None if isinstance(command, ErrorCode) else command


def possible_commands(line: bytes) -> Iterator[Command]:
    """Yield the settings and motions that another table may read in a line which this protocol refuses.

    Such a table may know small letters, start amid the line, end lines at LF, strip the eighth bit, pass over bytes
    that are no part of a number, stop at the first of them, or know exponents, commas and hexadecimal numbers.
    """
    text = bytes(byte & 0x7F for byte in line).decode("ascii")
    for index, letter in enumerate(text):
        verb = _LETTERS.get(letter)
        if verb is not None:
            rest = text[index + 1 :]
            yield from (Command(verb, value) for value in {*_numbers_in(rest)})


def glued(lines: list[bytes]) -> Iterator[bytes]:
    """Yield the lines that come about where bytes between two lines are lost: a beginning, and a later end."""
    ends = {line[cut:] for line in lines for cut in range(1, len(line))}
    for line in lines:
        if line[:1].decode("latin-1") in _LETTERS:
            yield from (line[:cut] + end for cut in range(1, len(line) + 1) for end in ends)


def _numbers_in(rest: str) -> Iterator[Decimal]:
    """Yield the numbers that the rest of a line may be read as."""
    words = [found[0].replace(",", ".") for found in _NUMBER.finditer(rest)]
    merged = "".join(character for character in rest if character in _SIGNS_AND_DIGITS or character == ".")
    digits = "".join(character for character in rest if character.isdigit())
    hexadecimal = [str(int(found[1], 16)) for found in _HEXADECIMAL.finditer(rest)]
    for word in (*words, merged, digits, f"-{digits}", *hexadecimal):
        try:
            value = Decimal(word)
        except InvalidOperation:
            continue
        if value.is_finite():
            yield value
