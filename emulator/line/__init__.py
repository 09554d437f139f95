"""The serial line: frames of bits, and bytes in transmission."""
