"""Wrong tables: the number, order and words of replies."""

from emulator.firmware.controller import IDLE
from protocol.codec import encode_reply
from protocol.messages import ErrorCode, Refusal, Verb
from tests.protocol.conformance.mutants.mutant import Line, Mutant, caught_by, verb_of


class SwapsReplies(Mutant):
    """Holds a reply back until the next one is sent."""

    held = b""

    def holds_back(self, command: Line) -> bool:
        raise NotImplementedError

    def _reply(self, command: Line) -> bytes:
        reply = super()._reply(command)
        if self.holds_back(command) and not self.held:
            self.held = reply
            return b""
        reply, self.held = reply + self.held, b""
        return reply


@caught_by("5.1/2")
class SwapsRepliesUnderLoad(SwapsReplies):
    """under load, replies are exchanged"""

    def holds_back(self, command: Line) -> bool:  # noqa: ARG002 - each is as good
        return self._serial.uart.waiting_count > 8


@caught_by("5.1/2:motion")
class PositionFirst(SwapsReplies):
    """in motion the position overtakes the latch"""

    def holds_back(self, command: Line) -> bool:
        return self.moving and verb_of(command) is Verb.READ_LATCH and self._serial.uart.waiting_count > 0


@caught_by("5.1/1")
class AnswersTwice(Mutant):
    """R is answered twice"""

    def _reply(self, command: Line) -> bytes:
        return super()._reply(command) * (1 + (verb_of(command) is Verb.MOVE_BY))


@caught_by("5.1/3")
class AnnouncesArrival(Mutant):
    """the end of a motion is reported"""

    was_moving = False

    def advance(self, ticks: int) -> None:
        super().advance(ticks)
        if self.was_moving and self._loop.state.firmware.motion == IDLE:
            self._serial.write(b"DONE\r", self.tick)
        self.was_moving = self.moving


@caught_by("5.1/4")
class AnswersCrLf(Mutant):
    """replies end in CR LF"""

    def _reply(self, command: Line) -> bytes:
        return super()._reply(command) + b"\n"


def other_words(code: ErrorCode) -> type[Mutant]:
    class OtherWords(Mutant):
        __doc__ = f"refusal {code} has other words"

        def _reply(self, command: Line) -> bytes:
            return super()._reply(command).replace(code.text.encode(), b"syntax error")

    return OtherWords


for each in ErrorCode:
    caught_by(f"5.3/{each}")(other_words(each))


@caught_by("5.4/1")
class AnswersBadLines(Mutant):
    """in strict mode an invalid line is still answered"""

    def _reply(self, command: Line) -> bytes:
        return encode_reply(Refusal(command)) if isinstance(command, ErrorCode) else super()._reply(command)


@caught_by("5.4/2")
class SulksWhenItRefused(Mutant):
    """in strict mode a line soon after a refused one has no reply"""

    sulks_until = 0

    def _reply(self, command: Line) -> bytes:
        reply = super()._reply(command)
        if not reply:
            self.sulks_until = self.tick + 50
        return reply if self.tick >= self.sulks_until else b""
