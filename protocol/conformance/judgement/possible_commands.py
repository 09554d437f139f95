"""Commands that a table may read in a line: those of this protocol, and those of a wider grammar than clause 4.1.

No I/O.
"""

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
    """Return the command that every table of this protocol reads in a line that may contain LF.

    Return None for a refused line.
    """
    text = line.replace(b"\n", b"")
    if len(text) > LINE_LIMIT or text.translate(None, _PRINTABLE):
        return None
    command = decode_command(text)
    return None if isinstance(command, ErrorCode) else command


def possible_commands(line: bytes) -> Iterator[Command]:
    """Yield the settings and motions that another table may read in a line that this protocol refuses.

    Another table may accept lowercase letters, start within the line, end lines at LF, or clear the eighth bit. It may
    skip bytes that do not belong to a number, or stop at the first of them. It may also read exponents, commas and
    hexadecimal numbers.
    """
    text = bytes(byte & 0x7F for byte in line).decode("ascii")
    for index, letter in enumerate(text):
        verb = _LETTERS.get(letter)
        if verb is not None:
            rest = text[index + 1 :]
            yield from (Command(verb, value) for value in {*_numbers_in(rest)})


def glued(lines: list[bytes]) -> Iterator[bytes]:
    """Yield the lines that result from lost bytes: the start of one line and the end of a later one."""
    ends = {line[cut:] for line in lines for cut in range(1, len(line))}
    for line in lines:
        if line[:1].decode("latin-1") in _LETTERS:
            yield from (line[:cut] + end for cut in range(1, len(line) + 1) for end in ends)


def _numbers_in(rest: str) -> Iterator[Decimal]:
    """Yield the numbers that can be read from the rest of a line."""
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
