"""Wrong tables: the number, order and words of replies."""

from emulator.firmware import IDLE
from protocol.messages import Verb
from tests.protocol.conformance.mutants.mutant import Line, Mutant, caught_by, verb_of


@caught_by("5.1/2")
class SwapsRepliesUnderLoad(Mutant):
    """under load replies change places"""

    held = b""

    def _reply(self, command: Line) -> bytes:
        reply = super()._reply(command)
        busy = self._serial.uart.waiting_count > 8
        if busy and not self.held:
            self.held = reply
            return b""
        reply, self.held = reply + self.held, b""
        return reply


@caught_by("5.1/1")
class AnswersTwice(Mutant):
    """R is answered twice"""

    def _reply(self, command: Line) -> bytes:
        return super()._reply(command) * (1 + (verb_of(command) is Verb.MOVE_BY))


@caught_by("5.1/3")
class AnnouncesArrival(Mutant):
    """the end of a motion is announced"""

    was_moving = False

    def advance(self, ticks: int) -> None:
        super().advance(ticks)
        if self.was_moving and self._state.firmware.motion == IDLE:
            self._serial.write(b"DONE\r", self.tick)
        self.was_moving = self.moving


@caught_by("5.1/4")
class AnswersCrLf(Mutant):
    """replies end in CR LF"""

    def _reply(self, command: Line) -> bytes:
        return super()._reply(command) + b"\n"


@caught_by("5.3/2")
class OtherWords(Mutant):
    """a refusal has other words"""

    def _reply(self, command: Line) -> bytes:
        return super()._reply(command).replace(b"bad number", b"syntax error")
