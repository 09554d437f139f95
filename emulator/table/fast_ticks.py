"""Long runs of undisturbed ticks at machine speed, if numba is installed.

A compiled tick takes a hundredth of the time of an interpreted one. But numba has to be imported first, which takes
about half a second. The code has to be compiled too (some seconds) if no earlier run has stored it. Ticks are
interpreted until they have cost about as much. So no session takes more than twice the time of the better choice.
"""

import sys
from collections.abc import Callable
from contextlib import nullcontext
from importlib.util import find_spec
from typing import Final

from emulator.table.tick import TableConstants, TableState, run_undisturbed
from protocol.kernels.kept_code import is_kept
from protocol.program.interrupts import signals_wait

Run = Callable[[TableConstants, TableState, float, int], tuple[TableState, bool]]
"""Computes undisturbed ticks; see `tick.run_undisturbed`."""

SHORT_TICKS: Final = 6
"""Fewer ticks are interpreted: a compiled call takes as long as some interpreted ticks."""

LOADED_TICKS: Final = 10_000
"""Number of interpreted ticks that take as long as the first compiled one, with numba imported and code stored."""

KEPT_TICKS: Final = 150_000
"""The same if machine code is stored from an earlier run, and numba is not yet imported."""

NEW_TICKS: Final = 1_000_000
"""The same without stored machine code."""

_PIECE_TICKS = 1000
_LONGEST_CALL_TICKS = 10_000_000
"""Number of ticks per call, a third of a second, during which Ctrl-C has to wait."""


class FastTicks:
    """`tick.run_undisturbed`, bit-identical, interpreted at first and compiled when that is faster.

    Attributes:
        warm_up_ticks: number of ticks interpreted at first; None until the best number is known.
    """

    def __init__(self, warm_up_ticks: int | None = None) -> None:
        self.warm_up_ticks = warm_up_ticks
        self._interpreted_ticks = 0
        self._compiled: Run | None = None
        self._loaded: set[int] = set()
        self._is_hopeless = find_spec("numba") is None

    @property
    def is_compiled(self) -> bool:
        """Whether long runs are compiled from now on."""
        return self._compiled is not None

    def __call__(
        self, constants: TableConstants, state: TableState, load_torque_Nm: float, ticks: int
    ) -> tuple[TableState, bool]:
        """Return the table after ticks without external events, and whether it rests."""
        resting = False
        while ticks > 0 and not resting:
            if ticks < SHORT_TICKS or not self._pays():
                some = min(ticks, _PIECE_TICKS)
                state, resting = run_undisturbed(constants, state, load_torque_Nm, some)
                self._interpreted_ticks += some
            else:
                assert self._compiled is not None
                some = min(ticks, _LONGEST_CALL_TICKS)
                kind = len(state.firmware.counts)  # arguments that determine the types of constants and state
                with nullcontext() if kind in self._loaded else signals_wait():  # numba must not be interrupted
                    state, resting = self._compiled(constants, state, load_torque_Nm, some)
                self._loaded.add(kind)
            ticks -= some
        return state, resting

    def _pays(self) -> bool:
        """Return whether compiled code exists, or should exist now."""
        if self._compiled is not None:
            return True
        if self._is_hopeless or (self._interpreted_ticks < LOADED_TICKS and self.warm_up_ticks is None):
            return False
        if self.warm_up_ticks is None:
            self.warm_up_ticks = NEW_TICKS
            if is_kept(run_undisturbed):
                self.warm_up_ticks = LOADED_TICKS if "numba" in sys.modules else KEPT_TICKS
        if self._interpreted_ticks < self.warm_up_ticks:
            return False
        try:
            from emulator.table.machine_code import compiled  # noqa: PLC0415  # numba is imported only when that is faster

            self._compiled = compiled(run_undisturbed)
        except (ImportError, OSError, RuntimeError):  # numba is broken, or has no writable folder
            self._is_hopeless = True
        return self._compiled is not None
