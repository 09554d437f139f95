"""Make numba compile the tick when a compiled function calls it.

The compiled functions are those that the emulator interprets, so the states are bit-identical; tests check this. This
module needs numba, the emulator does not.
"""

from types import FunctionType

from emulator import int32
from emulator.firmware import controller, fixed_point, pid, profiler
from emulator.plant import drive_train, encoder, friction
from emulator.table import tick
from protocol.kernels.machine_code import compiled, inlined

__all__ = ["compiled", "inlined"]

_MODULES = (int32, fixed_point, friction, drive_train, encoder, profiler, pid, controller, tick)


# The functions are inlined, so that the state stays in registers: this makes a tick four times as fast.
for _module in _MODULES:
    for _function in list(vars(_module).values()):
        if isinstance(_function, FunctionType) and _function.__module__ == _module.__name__:
            inlined(_function)
