"""Compile functions with numba, and keep their machine code between runs under what they are (`code_digest`).

Numba's own cache checks only whether the file of the *called* function has changed. So it would run old code of a
function that is called in another file. Also two processes that compile at once may exchange the code of two
signatures. This module needs numba; nothing imports it before something has to be compiled.
"""

import gc
import pickle
import secrets
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from functools import partial
from typing import Any

import numba
import numba.core.types
from numba.core import config
from numba.core.bytecode import FunctionIdentity
from numba.core.caching import _Cache
from numba.core.compiler import CompileResult
from numba.core.datamodel.models import OpaqueModel
from numba.core.datamodel.registry import register_default
from numba.core.serialize import dumps
from numba.extending import register_jitable

from protocol.kernels.code_digest import NoDigestError, code_digest
from protocol.kernels.kept_code import code_folder, code_name, compiled_by_one, keep_code, load_code

_types: Any = numba.core.types
_OPTIONS = {"error_model": "numpy", "nogil": True}
"""No Python objects, no bounds checks, IEEE arithmetic (no fast-math, no fused operations)."""
_WITHIN_OPTIONS = {**_OPTIONS, "no_cpython_wrapper": True, "no_cfunc_wrapper": True}
_INLINED_OPTIONS = {"error_model": "numpy", "forceinline": True}

# Numba numbers what it compiles from 1 in each process, and puts the numbers into the names of symbols. In a process
# that loads what others have compiled, calls of one function would end in another one of the same name and number.
_NAMES_ARE_OURS = hasattr(
    FunctionIdentity, "_unique_ids"
)  # where another numba numbers in another way, nothing is kept
FunctionIdentity._unique_ids = iter(partial(secrets.randbits, 63), 0)  # noqa: SLF001  # there is no option


def compiled(function: Callable[..., Any]) -> Any:  # noqa: ANN401  # numba's dispatcher
    """Return `function` compiled at its first call, or taken from an earlier run of the same code."""
    if config.DISABLE_JIT:
        return function
    dispatcher = numba.njit(**_OPTIONS)(function)
    kept = _KeptCode(function)
    dispatcher._cache = kept  # noqa: SLF001  # as numba's `enable_caching` does
    compile_signature = dispatcher.compile

    def compile_or_load(sig: Any) -> Any:  # noqa: ANN401  # numba's
        with kept.compiling():
            return compile_signature(sig)

    dispatcher.compile = compile_or_load
    return dispatcher


def within_type(function: Callable[..., Any]) -> Any:  # noqa: ANN401  # numba's type
    """Return the type of `function` for compiled callers only: it has no wrapper for Python, and is not kept alone."""
    return _Within(numba.njit(**_WITHIN_OPTIONS)(function))


def inlined(function: Callable[..., Any]) -> None:
    """Let numba compile a plain function into its compiled callers, instead of a call."""
    register_jitable(**_INLINED_OPTIONS)(function)


class _Within(_types.Dispatcher):  # type: ignore[misc]  # numba has no types
    """A compiled function that compiled ones call; an argument that is a constant gets no code of its own."""

    def __init__(self, dispatcher: Any) -> None:  # noqa: ANN401  # numba's
        super().__init__(dispatcher)
        self._kept_alive = dispatcher  # numba's type holds it weakly

    def get_call_type(self, context: Any, args: Any, kws: Any) -> Any:  # noqa: ANN401  # numba's
        args = tuple(map(_types.unliteral, args))
        return super().get_call_type(context, args, {name: _types.unliteral(kind) for name, kind in kws.items()})


register_default(_Within)(OpaqueModel)


class _KeptCode(_Cache):  # type: ignore[misc]  # numba has no types
    """The machine code of one function, a file for each of its signatures."""

    def __init__(self, function: Callable[..., Any]) -> None:
        self._function = function
        self._compiling: str | None = None
        self._turn = ExitStack()

    @contextmanager
    def compiling(self) -> Iterator[None]:
        """Compile here, or wait for another process that does, without looking for garbage: a sixth of the time."""
        collects = gc.isenabled()
        gc.disable()
        try:
            yield
        finally:
            self._turn.close()
            if collects:
                gc.enable()

    @property
    def cache_path(self) -> str:
        return str(code_folder())

    def load_overload(self, sig: Any, target_context: Any) -> Any:  # noqa: ANN401  # numba's
        target_context.refresh()
        self._compiling = name = self._file_name(sig, target_context)
        if name is None:
            return None
        found = _loaded(name, sig, target_context)
        if found is None:
            self._turn.enter_context(compiled_by_one(name))
            found = _loaded(name, sig, target_context)
        return found

    def save_overload(self, sig: Any, data: Any) -> None:  # noqa: ANN401  # numba's
        """Keep what was compiled, under the name that was not found just before."""
        if self._compiling is None or data.lifted or data.library.has_dynamic_globals:
            return
        if self._compiling == self._file_name(sig, data.target_context):  # no global was changed meanwhile
            keep_code(self._compiling, dumps(data._reduce()))  # noqa: SLF001  # as numba's own cache does

    def enable(self) -> None:
        """It always is."""

    def disable(self) -> None:
        """It never is."""

    def flush(self) -> None:
        """Nothing is ever stale."""

    def _file_name(self, sig: Any, target_context: Any) -> str | None:  # noqa: ANN401  # numba's
        name = code_name(self._function) if _NAMES_ARE_OURS else None
        target = str(target_context.codegen().magic_tuple())
        options = (*_OPTIONS.items(), *_WITHIN_OPTIONS.items(), *_INLINED_OPTIONS.items())
        try:
            digest = code_digest(target, options, _settings(), *map(_type_parts, _arguments(sig)))
        except NoDigestError:
            return None
        return None if name is None else f"{name}-{digest[:16]}"


def _loaded(name: str, sig: Any, target_context: Any) -> Any:  # noqa: ANN401  # numba's
    """Return what was kept under a name, ready to be called; None where that must be compiled."""
    code = load_code(name)
    if code is None:
        return None
    try:
        result = CompileResult._rebuild(target_context, *pickle.loads(code))  # noqa: S301, SLF001  # this user's, whole
    except Exception:  # of whatever kind: what cannot be loaded is compiled
        return None
    return result if result.signature.args == _arguments(sig) else None


def _arguments(sig: Any) -> tuple[Any, ...]:  # noqa: ANN401  # numba's
    return tuple(getattr(sig, "args", sig))


def _settings() -> list[str]:
    """Return numba's settings, from the environment and its own file, but where files lie and how many threads run."""
    return sorted(
        f"{name} {value!r}"
        for name, value in vars(config).items()
        if name.isupper() and not name.startswith(("CACHE_", "NUMBA_"))
    )


_PLAIN_TYPES = (
    _types.Number,
    _types.Boolean,
    _types.Array,
    _types.NoneType,
    _types.Literal,
    _types.Omitted,
    _types.UnicodeType,
)


def _type_parts(kind: Any) -> tuple[Any, ...]:  # noqa: ANN401  # numba's
    """Return a text that distinguishes a type from all others."""
    if isinstance(kind, _types.BaseTuple):
        named = (kind.instance_class.__module__, kind.instance_class) if isinstance(kind, _types.BaseNamedTuple) else ()
        return (type(kind).__name__, named, *map(_type_parts, kind.types))
    if isinstance(kind, _PLAIN_TYPES):
        return (type(kind).__name__, str(kind))
    raise NoDigestError(f"{kind} has no digest")
