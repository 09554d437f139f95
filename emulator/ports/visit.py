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

    @property
    def is_doubtful(self) -> bool:
        """Whether the bytes may be of several clients: any line may then be half of one's and half of another's."""
        return self.writers > 1
