"""Convert messages to lines and lines to messages, without I/O.

A line from outside is checked, never trusted. A malformed command is a result: the error that the table sends. A
malformed reply is an error of the other side (`UnexpectedReply`). An error of this program is `ProtocolMisuse`.
"""

import re
from decimal import ROUND_HALF_EVEN, Context, Decimal, InvalidOperation

from protocol.errors import ProtocolMisuse, UnexpectedReply
from protocol.messages import ANGLE_LETTERS, LINE_LIMIT, VERBS, Angle, Command, ErrorCode, Ok, Refusal, Reply, Verb

MAX_DECIMALS = 6

_NUMBER = re.compile(rb"[+-]?[0-9]+(?:\.[0-9]+)?")
_ANGLE = re.compile(rf"([{ANGLE_LETTERS}]) (-?[0-9]+\.[0-9]+)".encode())
_REFUSAL = re.compile(rb"ERR ([1-5])(?: .*)?")
_VERB_OF_LETTER = {verb.encode(): verb for verb in Verb}
_EXACT = Context(prec=LINE_LIMIT, rounding=ROUND_HALF_EVEN, traps=[InvalidOperation])


def encode_command(command: Command, decimals: int = 1) -> bytes:
    """Return the line for `command`, with its CR. The number is rounded to `decimals` places.

    Raises:
        ProtocolMisuse: a number is missing, not expected, not finite, or too long for a line.
    """
    if VERBS[command.verb].takes_number != (command.value is not None):
        wanted = "exactly one number" if VERBS[command.verb].takes_number else "no number"
        raise ProtocolMisuse(f"{command.verb.name} ({command.verb}) takes {wanted}, not {command.value}")
    if command.value is None:
        return _line(command.verb)
    return _line(f"{command.verb} {_fixed_point(command.value, decimals)}")


def decode_command(line: bytes) -> Command | ErrorCode:
    """Return the command in `line` (without its CR), or the error to send.

    Only the form is checked. The table checks whether a number is within its range.
    """
    verb = _VERB_OF_LETTER.get(line[:1])
    if verb is None:
        return ErrorCode.UNKNOWN_COMMAND
    number = line[1:].strip(b" ")
    if not VERBS[verb].takes_number:
        return ErrorCode.BAD_NUMBER if number else Command(verb)
    if _NUMBER.fullmatch(number) is None:
        return ErrorCode.BAD_NUMBER
    return Command(verb, Decimal(number.decode()))


def encode_reply(reply: Reply, decimals: int = 1) -> bytes:
    """Return the line for `reply`, with its CR. An angle is rounded to `decimals` places.

    Raises:
        ProtocolMisuse: the angle is not finite or too long for a line, or the verb does not read an angle.
    """
    match reply:
        case Angle(verb, angle_deg):
            if VERBS[verb].reply is not Angle:
                raise ProtocolMisuse(f"{verb.name} ({verb}) does not read an angle")
            return _line(f"{verb} {_fixed_point(angle_deg, decimals)}")
        case Ok():
            return _line("OK")
        case Refusal(code):
            return _line(f"ERR {code} {code.text}")


def decode_reply(line: bytes) -> Reply:
    """Return the reply in `line` (without its CR).

    An angle needs a decimal point and a digit after it: most replies that lost their end are detected this way. The
    text after an error number is free. Spaces before the CR are allowed, because Table 1 can be read as having them.

    Raises:
        UnexpectedReply: the line is not a reply of the protocol.
    """
    text = line.rstrip(b" ")
    if text == b"OK":
        return Ok()
    if angle := _ANGLE.fullmatch(text):
        return Angle(_VERB_OF_LETTER[angle[1]], Decimal(angle[2].decode()))
    if refusal := _REFUSAL.fullmatch(text):
        return Refusal(ErrorCode(int(refusal[1])))
    raise UnexpectedReply(f"{line!r} is not a reply of the protocol")


def _fixed_point(value: Decimal, decimals: int) -> str:
    if not 1 <= decimals <= MAX_DECIMALS:
        raise ProtocolMisuse(f"decimals is {decimals}; allowed are 1 to {MAX_DECIMALS}")
    if not value.is_finite():
        raise ProtocolMisuse(f"{value} is not a finite number")
    try:
        rounded = value.quantize(Decimal(1).scaleb(-decimals), context=_EXACT)
    except InvalidOperation:
        raise ProtocolMisuse(f"{value} does not fit a line of {LINE_LIMIT} bytes") from None
    return f"{rounded or rounded.copy_abs():f}"


def _line(text: str) -> bytes:
    if len(text) > LINE_LIMIT:
        raise ProtocolMisuse(f"{text!r} does not fit a line of {LINE_LIMIT} bytes")
    return text.encode() + b"\r"
