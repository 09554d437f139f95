"""Wrong tables: numbers that lose their sign, their decimals or their first digits."""

from collections.abc import Callable
from decimal import ROUND_DOWN, ROUND_HALF_EVEN, Decimal

from protocol.messages import Verb
from tests.protocol.conformance.mutants.mutant import RereadsLines, RereadsNumbers, caught_by

SETTINGS = (Verb.SET_SPEED, Verb.SET_ACCELERATION)
MOTIONS = (Verb.MOVE_TO, Verb.MOVE_BY)


@caught_by("4.1/5")
class SignGoesWithZero(RereadsNumbers):
    """the sign is lost when the whole part is 0"""

    def number_instead_of(self, value: Decimal) -> Decimal:
        return abs(value) if abs(value) < 1 else value


@caught_by("4.1/5")
class DecimalsArePositive(RereadsNumbers):
    """-1.5 is read as -0.5: the sign is that of the whole part alone"""

    def number_instead_of(self, value: Decimal) -> Decimal:
        whole = value.to_integral_value(ROUND_DOWN)
        return whole + abs(value - whole)


def verb_loses_its_sign(verb: Verb, case: str) -> None:
    class LosesItsSign(SignGoesWithZero):
        __doc__ = f"the sign of {verb} is lost when the whole part is 0"
        verbs = frozenset({verb})

    caught_by(case)(LosesItsSign)


def verb_loses_decimals(verb: Verb, step: str, rounding: str, case: str) -> None:
    class LosesDecimals(RereadsNumbers):
        __doc__ = f"{verb} is a whole number of {step}, with {rounding}"
        verbs = frozenset({verb})

        def number_instead_of(self, value: Decimal) -> Decimal:
            return (value / Decimal(step)).quantize(Decimal(1), rounding) * Decimal(step)

    caught_by(case)(LosesDecimals)


def decimals_overflow(verbs: tuple[Verb, ...], bits: int) -> None:
    class DecimalsOverflow(RereadsLines):
        __doc__ = f"the decimals of {' and '.join(verbs)} are read into {bits} bits"

        def instead_of(self, line: bytes) -> bytes:
            number, point, decimals = line.partition(b".")
            if line[:1].decode() not in verbs or not decimals.strip().isdigit():
                return line
            places = len(decimals.strip())
            return number + point + b"%0*d" % (places, int(decimals) % 2**bits % 10**places)

    caught_by("4.1/8:settings" if Verb.SET_SPEED in verbs else "4.1/8")(DecimalsOverflow)


def whole_part_wraps(verb: Verb, bits: int, case: str, signed: bool = False) -> None:
    class WholePartWraps(RereadsNumbers):
        __doc__ = f"the whole part of {verb} wraps at 2^{bits}{', with a sign' * signed}"
        verbs = frozenset({verb})

        def number_instead_of(self, value: Decimal) -> Decimal:
            whole = int(value)
            wrapped = (whole + signed * 2 ** (bits - 1)) % 2**bits - signed * 2 ** (bits - 1)
            return value - whole + (wrapped if signed or whole > 0 else whole)

    caught_by(case)(WholePartWraps)


def only_some_digits(name: str, cut: Callable[[bytes], bytes]) -> None:
    class OnlySomeDigits(RereadsLines):
        __doc__ = f"of a number it keeps {name}"

        def instead_of(self, line: bytes) -> bytes:
            letter, number = line[:1], line[1:].strip()
            long = letter in b"PRSA" and number.isdigit() and len(number.lstrip(b"0")) > 8
            return letter + cut(number) if long else line

    caught_by("4.1/9")(OnlySomeDigits)


for each in (*SETTINGS, *MOTIONS):
    verb_loses_its_sign(each, "4.1/5")
for each in SETTINGS:
    verb_loses_decimals(each, "0.1", ROUND_DOWN, "4.1/8:settings")
    verb_loses_decimals(each, "0.1", ROUND_HALF_EVEN, "4.1/8:settings")
    for width in (8, 16):
        whole_part_wraps(each, width, "4.1/9")
    for width in (16, 32):
        whole_part_wraps(each, width, "4.1/9", signed=True)
for one in ("0.1", "0.001", "0.001953125"):
    for how in (ROUND_DOWN, ROUND_HALF_EVEN):
        verb_loses_decimals(Verb.MOVE_BY, one, how, "4.5/2")
for width in (32, 64):
    decimals_overflow(MOTIONS, width)
    decimals_overflow(SETTINGS, width)
for each in MOTIONS:
    whole_part_wraps(each, 32, "4.1/9")
whole_part_wraps(Verb.MOVE_BY, 16, "4.1/8:whole")
whole_part_wraps(Verb.MOVE_BY, 17, "4.1/8:whole", signed=True)
whole_part_wraps(Verb.MOVE_TO, 16, "6.1/2")
only_some_digits("the first two digits", lambda number: number[:2])
only_some_digits("the last digit", lambda number: number[-1:])
