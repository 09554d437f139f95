"""One table of cases each for commands and replies; encoder and decoder are tested with the same rows."""

from decimal import Decimal

import pytest
from hypothesis import given
from hypothesis import strategies as st

from protocol import (
    VERBS,
    Angle,
    Command,
    ErrorCode,
    Ok,
    ProtocolMisuse,
    Refusal,
    Reply,
    UnexpectedReply,
    Verb,
    decode_command,
    decode_reply,
    encode_command,
    encode_reply,
)

COMMANDS = [
    (Command(Verb.READ_POSITION), b"H"),
    (Command(Verb.READ_LATCH), b"L"),
    (Command(Verb.MOVE_TO, Decimal("370.0")), b"P 370.0"),
    (Command(Verb.MOVE_TO, Decimal("0.0")), b"P 0.0"),
    (Command(Verb.MOVE_BY, Decimal("-10.5")), b"R -10.5"),
    (Command(Verb.SET_SPEED, Decimal("40.0")), b"S 40.0"),
    (Command(Verb.SET_ACCELERATION, Decimal("0.1")), b"A 0.1"),
]

REPLIES = [
    (Ok(), b"OK"),
    (Angle(Verb.READ_POSITION, Decimal("0.0")), b"H 0.0"),
    (Angle(Verb.READ_POSITION, Decimal("-4194304.0")), b"H -4194304.0"),
    (Angle(Verb.READ_LATCH, Decimal("725.3")), b"L 725.3"),
    (Refusal(ErrorCode.UNKNOWN_COMMAND), b"ERR 1 unknown command"),
    (Refusal(ErrorCode.BAD_NUMBER), b"ERR 2 bad number"),
    (Refusal(ErrorCode.OUT_OF_RANGE), b"ERR 3 out of range"),
    (Refusal(ErrorCode.LINE_TOO_LONG), b"ERR 4 line too long"),
    (Refusal(ErrorCode.BAD_BYTE), b"ERR 5 bad byte"),
]

OTHER_SPELLINGS = [
    (b"H   ", Command(Verb.READ_POSITION)),
    (b"P5", Command(Verb.MOVE_TO, Decimal(5))),
    (b"P    5  ", Command(Verb.MOVE_TO, Decimal(5))),
    (b"P +5", Command(Verb.MOVE_TO, Decimal(5))),
    (b"P -0", Command(Verb.MOVE_TO, Decimal(0))),
    (b"R 007.50", Command(Verb.MOVE_BY, Decimal("7.5"))),
    (b"S 12.345678", Command(Verb.SET_SPEED, Decimal("12.345678"))),
    (b"A 99999999999999", Command(Verb.SET_ACCELERATION, Decimal(99999999999999))),
]

BAD_COMMANDS = [
    (b"", ErrorCode.UNKNOWN_COMMAND),
    (b"h", ErrorCode.UNKNOWN_COMMAND),
    (b"X 1", ErrorCode.UNKNOWN_COMMAND),
    (b" H", ErrorCode.UNKNOWN_COMMAND),
    (b"12.0", ErrorCode.UNKNOWN_COMMAND),
    (b"\xff", ErrorCode.UNKNOWN_COMMAND),
    (b"H 1", ErrorCode.BAD_NUMBER),
    (b"HH", ErrorCode.BAD_NUMBER),
    (b"P", ErrorCode.BAD_NUMBER),
    (b"P 5.", ErrorCode.BAD_NUMBER),
    (b"P .5", ErrorCode.BAD_NUMBER),
    (b"P --5", ErrorCode.BAD_NUMBER),
    (b"P - 5", ErrorCode.BAD_NUMBER),
    (b"P 1 2", ErrorCode.BAD_NUMBER),
    (b"P 1,5", ErrorCode.BAD_NUMBER),
    (b"P 1e400", ErrorCode.BAD_NUMBER),
    (b"P nan", ErrorCode.BAD_NUMBER),
    (b"P inf", ErrorCode.BAD_NUMBER),
    (b"P 1_0", ErrorCode.BAD_NUMBER),
    (b"P \xd9\xa3", ErrorCode.BAD_NUMBER),
]

MALFORMED_REPLIES = [
    b"",
    b"ok",
    b"O",
    b"OKOK",
    b"H",
    b"H 1",
    b"H 1.",
    b"H12.0",
    b"H  12.0",
    b"H +1.0",
    b"H 12H 12.3",
    b"P 1.0",
    b"H nan",
    b"ERR",
    b"ERR 0 nothing",
    b"ERR 6 out of paper",
    b"ERR 12",
]

verbs_with_number = st.sampled_from([verb for verb in Verb if VERBS[verb].takes_number])
verbs_that_read = st.sampled_from([verb for verb in Verb if VERBS[verb].reply is Angle])
tenths = st.integers(-(10**9), 10**9).map(lambda tenth: Decimal(tenth).scaleb(-1))


@pytest.mark.parametrize(("command", "line"), COMMANDS)
def test_commands_and_their_lines(command: Command, line: bytes) -> None:
    assert encode_command(command) == line + b"\r"
    assert decode_command(line) == command


@pytest.mark.parametrize(("reply", "line"), REPLIES)
def test_replies_and_their_lines(reply: Reply, line: bytes) -> None:
    assert encode_reply(reply) == line + b"\r"
    assert decode_reply(line) == reply


@pytest.mark.parametrize(("line", "command"), OTHER_SPELLINGS)
def test_other_spellings_of_a_command_are_understood(line: bytes, command: Command) -> None:
    assert decode_command(line) == command


@pytest.mark.parametrize(("line", "error"), BAD_COMMANDS)
def test_a_bad_command_is_a_result_not_an_exception(line: bytes, error: ErrorCode) -> None:
    assert decode_command(line) is error


@pytest.mark.parametrize("line", MALFORMED_REPLIES)
def test_a_malformed_reply_is_the_peers_fault(line: bytes) -> None:
    with pytest.raises(UnexpectedReply):
        decode_reply(line)


def test_spaces_before_the_end_of_a_reply_are_allowed() -> None:
    assert decode_reply(b"OK ") == Ok()
    assert decode_reply(b"L 1.5 ") == Angle(Verb.READ_LATCH, Decimal("1.5"))


def test_the_words_of_an_error_are_free() -> None:
    assert decode_reply(b"ERR 3") == Refusal(ErrorCode.OUT_OF_RANGE)
    assert decode_reply(b"ERR 3 hors limites") == Refusal(ErrorCode.OUT_OF_RANGE)


@pytest.mark.parametrize(
    "command",
    [
        Command(Verb.READ_POSITION, Decimal(1)),
        Command(Verb.MOVE_TO),
        Command(Verb.MOVE_TO, Decimal("nan")),
        Command(Verb.MOVE_BY, Decimal("-inf")),
        Command(Verb.SET_SPEED, Decimal("1e400")),
        Command(Verb.MOVE_TO, Decimal(10) ** 28),
    ],
)
def test_what_the_protocol_cannot_say_is_misuse(command: Command) -> None:
    with pytest.raises(ProtocolMisuse):
        encode_command(command)


@pytest.mark.parametrize("decimals", [0, -1, 7])
def test_an_impossible_number_of_decimals_is_misuse(decimals: int) -> None:
    with pytest.raises(ProtocolMisuse, match="1 to 6"):
        encode_command(Command(Verb.MOVE_TO, Decimal(1)), decimals)


@pytest.mark.parametrize(
    "reply",
    [Angle(Verb.MOVE_TO, Decimal(1)), Angle(Verb.READ_LATCH, Decimal("nan")), Angle(Verb.READ_LATCH, Decimal("1e99"))],
)
def test_a_reply_that_the_protocol_cannot_say_is_misuse(reply: Reply) -> None:
    with pytest.raises(ProtocolMisuse):
        encode_reply(reply)


@pytest.mark.parametrize(
    ("angle_deg", "line"),
    [
        ("-0.04", b"H 0.0\r"),
        ("-0.05", b"H 0.0\r"),
        ("-0.051", b"H -0.1\r"),
        ("0.25", b"H 0.2\r"),
        ("0.35", b"H 0.4\r"),
        ("1e-400", b"H 0.0\r"),
    ],
)
def test_angles_are_rounded_to_nearest_even_and_zero_has_no_sign(angle_deg: str, line: bytes) -> None:
    assert encode_reply(Angle(Verb.READ_POSITION, Decimal(angle_deg))) == line


@given(verb=verbs_with_number, value=tenths)
def test_a_command_survives_the_wire(verb: Verb, value: Decimal) -> None:
    assert decode_command(encode_command(Command(verb, value))[:-1]) == Command(verb, value)


@given(verb=verbs_that_read, value=tenths, decimals=st.integers(1, 6))
def test_an_angle_survives_the_wire_at_any_number_of_decimals(verb: Verb, value: Decimal, decimals: int) -> None:
    line = encode_reply(Angle(verb, value), decimals)
    assert decode_reply(line[:-1]) == Angle(verb, value)
    assert len(line.partition(b".")[2]) == decimals + 1


@given(st.binary(max_size=40))
def test_any_bytes_are_a_command_or_an_error(line: bytes) -> None:
    assert isinstance(decode_command(line), Command | ErrorCode)


@given(count=st.integers(-(2**31), 2**31 - 1), decimals=st.integers(1, 6))
def test_counts_are_rounded_as_printf_rounds_them(count: int, decimals: int) -> None:
    angle_deg = count / 512  # exact: a binary fraction
    text = f"{angle_deg:.{decimals}f}"
    expected = text.removeprefix("-") if float(text) == 0 else text
    line = encode_reply(Angle(Verb.READ_POSITION, Decimal(angle_deg)), decimals)
    assert line == f"H {expected}\r".encode()
