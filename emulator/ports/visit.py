"""Assign the bytes of one look at a device to its clients, which share it one after the other."""

from typing import NamedTuple


class Visit(NamedTuple):
    """The state of the clients in one look at the device. They may have connected and disconnected one after the other.

    Attributes:
        writers: number of clients that may have sent some of the bytes of this look.
        counted: whether the present client is among them.
        left: a client has disconnected, and no other was connected.
        another_came: after that, another one has opened the device.
    """

    writers: int
    counted: bool
    left: bool = False
    another_came: bool = False

    @property
    def another_wrote(self) -> bool:
        """Whether a client is connected that came after another had disconnected, and has written."""
        return self.another_came and self.counted

    @property
    def is_doubtful(self) -> bool:
        """Whether the bytes may be from several clients: any line may then mix bytes of two clients."""
        return self.writers > 1
