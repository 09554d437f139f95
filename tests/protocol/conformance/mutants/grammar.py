"""Wrong tables: the grammar of a command."""

import re
from decimal import Decimal

from protocol.messages import Command, ErrorCode, Verb
from tests.protocol.conformance.mutants.mutant import Line, Mutant, RereadsLines, caught_by, value_of, verb_of


@caught_by("4.1/1")
class TakesLowerCase(Mutant):
    """lowercase letters are accepted"""

    def receive(self, data: bytes) -> None:
        super().receive(data.upper())


@caught_by("4.1/4")
class TakesTheFirstNumber(Mutant):
    """of two numbers the first is used"""

    def receive(self, data: bytes) -> None:
        super().receive(re.sub(rb"([PRSA] [0-9.]+) [0-9. ]+\r", rb"\1\r", data))


@caught_by("4.1/7")
class TakesExponents(Mutant):
    """numbers are read as a programming language reads them"""

    def receive(self, data: bytes) -> None:
        super().receive(re.sub(rb"1e1\r", b"10\r", data))


@caught_by("4.1/8")
class OneDecimal(Mutant):
    """decimals after the first are dropped"""

    def receive(self, data: bytes) -> None:
        super().receive(re.sub(rb"(\.[0-9])[0-9]+", rb"\1", data))


@caught_by("4.1/10")
class StopsWhenItRefuses(Mutant):
    """a refused line stops the motion"""

    def _reply(self, command: Line) -> bytes:
        reply = super()._reply(command)
        if reply.startswith(b"ERR"):
            super()._reply(Command(Verb.MOVE_BY, Decimal(0)))
        return reply


@caught_by("4.1/10")
class CutsWhatItRefuses(Mutant):
    """a speed above the limit is refused, but reduced to the limit"""

    def _reply(self, command: Line) -> bytes:
        if isinstance(command, Command) and command.verb is Verb.SET_SPEED and value_of(command) > 40:
            super()._reply(Command(command.verb, Decimal(40)))
        return super()._reply(command)


@caught_by("4.6/3")
class SaysOkFirst(Mutant):
    """OK is sent before the number is checked"""

    def _reply(self, command: Line) -> bytes:
        reply = super()._reply(command)
        return b"OK\r" if isinstance(command, Command) and reply.startswith(b"ERR") else reply


@caught_by("4.1/2")
class RefusesSpacesBehind(Mutant):
    """spaces before the CR are refused"""

    def receive(self, data: bytes) -> None:
        super().receive(re.sub(rb"([0-9]) +\r", rb"\1x\r", data))


@caught_by("4.1/2")
class NeedsASpace(Mutant):
    """R and A need a space before their number"""

    def receive(self, data: bytes) -> None:
        super().receive(re.sub(rb"([RA])([0-9])", rb"\1x\2", data))


@caught_by("4.1/3")
class OverlooksWhatFollows(Mutant):
    """text after a reading's letter is ignored"""

    def receive(self, data: bytes) -> None:
        super().receive(re.sub(rb"(^|\r)([HL])[^\r]+(?=\r)", rb"\1\2", data))


@caught_by("4.1/5")
class KnowsNoPlus(Mutant):
    """a plus sign is refused"""

    def receive(self, data: bytes) -> None:
        super().receive(data.replace(b"+", b"x"))


@caught_by("4.1/6")
class TakesHalfAPoint(Mutant):
    """a point needs no digit before it"""

    def receive(self, data: bytes) -> None:
        super().receive(re.sub(rb"([PRSA] -?)\.([0-9])", rb"\g<1>0.\2", data))


@caught_by("4.1/9")
class LongNumbersWrap(Mutant):
    """a number too long for the machine wraps"""

    def _reply(self, command: Line) -> bytes:
        if isinstance(command, Command) and command.value is not None:
            command = Command(command.verb, command.value % 2**15 if abs(command.value) > 2**31 else command.value)
        return super()._reply(command)


@caught_by("4.1/11")
class BusyInMotion(Mutant):
    """S and A are refused in a motion"""

    def _reply(self, command: Line) -> bytes:
        busy = self.moving and verb_of(command) in {Verb.SET_SPEED, Verb.SET_ACCELERATION}
        return super()._reply(ErrorCode.OUT_OF_RANGE if busy else command)


def seventh_letter(line: bytes) -> None:
    class SeventhLetter(Mutant):
        __doc__ = f"{line.decode()} is a command"

        def _answer(self, got: bytes | ErrorCode) -> bytes:
            return b"OK\r" if got == line else super()._answer(got)

    caught_by("4.1/1")(SeventhLetter)


for each in (b"V", b"B", b"Z", b"V 1", b"v", b"s 1", b"7", b"#", b"*IDN?"):
    seventh_letter(each)


@caught_by("4.1/3")
class KnowsHome(RereadsLines):
    """HOME is read as H"""

    def instead_of(self, line: bytes) -> bytes:
        return b"H" if line == b"HOME" else line


@caught_by("4.1/4")
class KnowsStop(RereadsLines):
    """STOP is read as R 0"""

    def instead_of(self, line: bytes) -> bytes:
        return b"R 0" if line == b"STOP" else line
