"""The serial line: frames of bits, and the bytes on their way."""
