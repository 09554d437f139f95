"""Asynchronous framing (8N1): what a receiver reads when its baud rate differs from the sender's.

A receiver waits for a falling edge. Half a bit later it checks the line again for the start bit. Then it samples the
middle of each of the eight data bits. It uses *its own* bit time for all of this.
"""

BITS_PER_FRAME = 10
"""A start bit, eight data bits and a stop bit."""

RATE_TOLERANCE = 1.0 / 19.0
"""Maximum relative difference that is read without error.

The stop bit, sampled 9.5 bit times after the edge, is then half a bit off."""


def rates_agree(one_baud: int, other_baud: int) -> bool:
    """Return whether two ends with these rates can communicate."""
    return abs(one_baud - other_baud) <= RATE_TOLERANCE * max(one_baud, other_baud)


def read_at_rate(data: bytes, sender_baud: int, receiver_baud: int) -> bytes:
    """Return what a receiver at `receiver_baud` reads of bytes sent back to back at `sender_baud`.

    Bytes with a false stop bit are kept, as by a small controller that does not check framing errors.
    """
    if rates_agree(sender_baud, receiver_baud):
        return data
    line = _levels(data)
    bit = sender_baud / receiver_baud
    received = bytearray()
    edge = line.find(0)
    while edge >= 0:
        if _level(line, edge + 0.5 * bit):
            done = edge
        else:
            received.append(sum(_level(line, edge + (1.5 + k) * bit) << k for k in range(8)))
            done = int(edge + 9.5 * bit)
        edge = _next_falling_edge(line, done)
    return bytes(received)


def _levels(data: bytes) -> bytes:
    """Return the level of the line in each bit time of the sender: 0 for the start bit, least significant bit first."""
    return bytes(level for byte in data for level in (0, *(byte >> k & 1 for k in range(8)), 1))


def _level(line: bytes, position: float) -> int:
    """Return the level at a position in bit times of the sender; an idle line is high."""
    index = int(position)
    return line[index] if index < len(line) else 1


def _next_falling_edge(line: bytes, index: int) -> int:
    """Return the first low bit after a high one, with the high one at `index` or later; -1 if there is none."""
    high = line.find(1, index)
    return line.find(0, high) if high >= 0 else -1
