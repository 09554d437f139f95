"""Wrong tables: rules that let a client resynchronize."""

from protocol.messages import Verb
from tests.protocol.conformance.mutants.mutant import Line, Mutant, caught_by, verb_of


@caught_by("8.1/1")
class AlmostEnoughBuffer(Mutant):
    """the buffer holds 62 bytes"""

    def receive(self, data: bytes) -> None:
        super().receive(data[:62])


@caught_by("8.3/1")
class CancelIsIgnored(Mutant):
    """CAN is ignored, and the incomplete line is executed"""

    def receive(self, data: bytes) -> None:
        super().receive(data.replace(b"\x18", b""))


@caught_by("8.3/2")
class AnswersReadingsTwice(Mutant):
    """readings are answered twice, to be sure"""

    def _reply(self, command: Line) -> bytes:
        return super()._reply(command) * (1 + (verb_of(command) in {Verb.READ_POSITION, Verb.READ_LATCH}))


@caught_by("8.3/3")
class LooksForAnotherRate(Mutant):
    """after noise it searches for another baud rate, until it is switched off"""

    noise = 0

    def receive(self, data: bytes) -> None:
        self.noise += sum(byte >= 0x80 for byte in data)
        if self.noise < 10:
            super().receive(data)


@caught_by("8.3/4")
class CancelEmptiesTheBuffer(Mutant):
    """CAN drops the bytes sent with it"""

    def receive(self, data: bytes) -> None:
        head, cancel, _ = data.partition(b"\x18")
        super().receive(head + cancel + b"\r" * len(cancel))
