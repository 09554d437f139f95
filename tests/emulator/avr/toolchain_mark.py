"""The mark of tests that need compilers and simavr."""

import pytest

from emulator.avr.toolchain import lacking

needs_toolchain = pytest.mark.skipif(bool(lacking()), reason=lacking())
