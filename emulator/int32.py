"""The 32-bit register of the encoder's counter and of the firmware's numbers."""

INT32_MAX = (1 << 31) - 1


def wrap_int32(number: int) -> int:
    """Return the value of `number` in a 32-bit register in two's complement."""
    if -0x8000_0000 <= number <= INT32_MAX:
        return number
    return ((number + 0x8000_0000) & 0xFFFF_FFFF) - 0x8000_0000
