"""Whose bytes are they? What one look at a device, which several clients share one after the other, can tell of it."""

from typing import NamedTuple


class Visit(NamedTuple):
    """What is known of the clients of one look at the device, who may have come and gone one after the other.

    Attributes:
        writers: clients of whom the bytes of this look may hold some.
        counted: whether the one that is there now is among them.
        left: a client has left, and no other was there.
        another_came: after that, one has opened the device.
    """

    writers: int
    counted: bool
    left: bool = False
    another_came: bool = False

    @property
    def another_wrote(self) -> bool:
        """Whether a client is there who came when another had left, and has written."""
        return self.another_came and self.counted


def doubtful_lines(writers: int, data: bytes) -> int:
    """Return how many lines of `data`, from its first, may be half of one client's and half of another's.

    Nobody can tell where one client's bytes end. When the lines may be one for each client, as those of commands of a
    shell, a glued one can only be the first of them; otherwise it can be any.
    """
    ends = data.count(b"\r")
    if writers < 2 or not data:
        return 0
    return 1 if ends == writers and data.endswith(b"\r") else ends + 1
