"""Mark a numeric function to be compiled by numba at its first call; numba is not imported before that.

What is called from Python is compiled as a whole, with everything that it calls, and kept between runs. The parts have
no machine code of their own unless Python calls them too: that would double the time that compiling takes.
"""

from collections.abc import Callable
from functools import update_wrapper
from typing import Any, TypeVar, cast

Function = TypeVar("Function", bound=Callable[..., Any])


class _Kernel:
    """A function that runs compiled, called from Python or from another kernel."""

    def __init__(self, function: Callable[..., Any]) -> None:
        update_wrapper(self, function)
        self.py_func = function
        self._within: Any = None

    def __getattr__(self, name: str) -> Any:  # noqa: ANN401  # numba's dispatcher
        if name != "_compiled":
            raise AttributeError(name)
        from protocol.kernels.machine_code import compiled  # noqa: PLC0415  # see above

        self._compiled = compiled(self.py_func)
        return self._compiled

    def __call__(self, *arguments: Any) -> Any:  # noqa: ANN401  # what the function takes and returns
        return self._compiled(*arguments)

    @property
    def _numba_type_(self) -> Any:  # noqa: ANN401  # numba's type, of which it asks a global of a compiled function
        from protocol.kernels.machine_code import within_type  # noqa: PLC0415  # see above

        if self._within is None:
            self._within = within_type(self.py_func)
        return self._within


def kernel(function: Function) -> Function:
    """Return `function` compiled on its first call: no Python objects, no bounds checks, IEEE arithmetic.

    Floating-point results are those of the interpreted function to the last bit (no fast-math, no fused operations).
    """
    return cast("Function", _Kernel(function))
