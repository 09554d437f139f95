"""A digest of what a function computes: its byte code, and whatever that reads, in all files that it comes from.

Comments, docstrings, file names and line numbers do not belong to it. So machine code stored under this digest is
compiled again exactly when its source has changed.
"""

import dis
import enum
import hashlib
import sys
from collections.abc import Iterator
from types import CodeType, FunctionType, ModuleType
from typing import Any

_KNOWN_BY_VERSION = frozenset({"builtins", "llvmlite", "math", "numba", "numpy", "operator", "typing"})
"""Packages that are identified by their names. Code that stores something under a digest adds their versions."""

_LOADS_GLOBAL = frozenset({"LOAD_GLOBAL", "LOAD_NAME"})
_CONSTANT = (enum.Enum, tuple, list, frozenset, bool, int, float, complex, str, bytes, type(None), type(Ellipsis))


class NoDigestError(Exception):
    """A function reads something that has no digest, such as an open file."""


def code_digest(*values: object) -> str:
    """Return the digest of functions, and of constants, classes and modules as functions use them: 32 hex digits.

    Raises:
        NoDigestError: A function reads a value of another kind.
    """
    content = hashlib.sha256()
    try:
        for part in _Walk().parts(values):
            content.update(f"{len(part)}:{part}".encode())
    except (RecursionError, ValueError) as error:  # values or modules that hold themselves; an empty cell
        raise NoDigestError(str(error)) from error
    return content.hexdigest()[:32]


class _Walk:
    """A walk through all that functions read; what was met before is known by its number."""

    def __init__(self) -> None:
        self._met: dict[int, int] = {}

    def parts(self, value: Any) -> Iterator[str]:  # noqa: ANN401  # whatever a function may read
        """Yield texts that distinguish a value from all others."""
        function = getattr(value, "py_func", value)  # of a compiled function, its source
        if isinstance(value, _CONSTANT):
            yield from self._constant_parts(value)
        elif _is_known_by_version(value):
            yield f"known {_full_name(value)}"
        elif id(function) in self._met:
            yield f"met {self._met[id(function)]}"
        elif isinstance(function, FunctionType | type):
            self._met[id(function)] = len(self._met)
            yield from (
                self._function_parts(function) if isinstance(function, FunctionType) else self._class_parts(value)
            )
            yield from self.parts(sorted(getattr(value, "targetoptions", {}).items()))  # how numba compiles it
        elif hasattr(value, "dtype") and hasattr(value, "tobytes") and not value.dtype.hasobject:
            yield f"array {value.dtype} {value.shape} {value.tobytes().hex()}"
        else:
            raise NoDigestError(f"{value!r} has no digest")

    def _constant_parts(self, value: Any) -> Iterator[str]:  # noqa: ANN401  # one of `_CONSTANT`
        if isinstance(value, enum.Enum):
            yield f"member {value.name} {value.value!r}"
            yield from self.parts(type(value))
        elif isinstance(value, tuple | list):
            yield f"{type(value).__name__} {len(value)}"
            if type(value) not in {tuple, list}:
                yield from self.parts(type(value))
            for item in value:
                yield from self.parts(item)
        elif isinstance(value, frozenset):
            yield from self.parts(sorted(map(repr, value)))
        else:
            yield f"{type(value).__name__} {value!r}"

    def _function_parts(self, function: FunctionType) -> Iterator[str]:
        yield f"function {function.__module__} {function.__qualname__}"
        yield from self.parts(function.__defaults__)
        yield from self.parts(tuple(sorted((function.__kwdefaults__ or {}).items())))
        for cell in function.__closure__ or ():
            yield from self.parts(cell.cell_contents)
        yield from self._code_parts(function.__code__, function.__globals__)

    def _code_parts(self, code: CodeType, names: dict[str, Any]) -> Iterator[str]:
        yield code.co_code.hex()
        yield f"{code.co_exceptiontable.hex()} {code.co_flags}"
        yield f"{code.co_argcount} {code.co_posonlyargcount} {code.co_kwonlyargcount}"
        for each in (code.co_names, code.co_varnames, code.co_cellvars, code.co_freevars):
            yield from self.parts(each)
        instructions = list(dis.get_instructions(code))
        loaded = {each.arg for each in instructions if each.opcode in dis.hasconst}
        for number, constant in enumerate(code.co_consts):
            if isinstance(constant, CodeType):
                yield from self._code_parts(constant, names)
            elif number in loaded:  # a docstring is not
                yield from self.parts(constant)
        for name in sorted({str(each.argval) for each in instructions if each.opname in _LOADS_GLOBAL}):
            yield f"global {name}"
            if name in names:
                yield from self._read_parts(names[name], code)

    def _read_parts(self, value: object, code: CodeType) -> Iterator[str]:
        """Yield the parts of a global; of a module, those that the code may read."""
        if not isinstance(value, ModuleType) or _is_known_by_version(value):
            yield from self.parts(value)
            return
        yield f"module {value.__name__}"
        for name in sorted({name for name in code.co_names if hasattr(value, name)}):
            yield f"attribute {name}"
            yield from self._read_parts(getattr(value, name), code)

    def _class_parts(self, kind: type) -> Iterator[str]:
        if not _is_found_by_name(kind):
            raise NoDigestError(f"{kind!r} is local: code that is loaded again would make another class")
        yield f"class {kind.__module__} {kind.__qualname__}"
        if issubclass(kind, enum.Enum):
            yield from self.parts(tuple((name, member.value) for name, member in kind.__members__.items()))
        elif issubclass(kind, tuple) and hasattr(kind, "_fields"):
            named: Any = kind
            yield from self.parts((*named._fields, *sorted(named._field_defaults.items())))
        else:
            raise NoDigestError(f"{kind!r} has no digest")


def _is_known_by_version(value: object) -> bool:
    return _full_name(value).partition(".")[0] in _KNOWN_BY_VERSION and _is_found_by_name(value)


def _is_found_by_name(value: object) -> bool:
    """Return whether a module, class or function is the one that its name leads to in any process."""
    if isinstance(value, ModuleType):
        return sys.modules.get(value.__name__) is value
    module, name = _module_and_name(value)
    found: object = sys.modules.get(module)
    for part in name.split("."):
        found = getattr(found, part, None)
    return found is value and module != "__main__"


def _full_name(value: object) -> str:
    """Return the name of a module, function or class, or else an empty one."""
    if isinstance(value, ModuleType):
        return value.__name__
    return ".".join(_module_and_name(value)) if callable(value) else ""


def _module_and_name(value: object) -> tuple[str, str]:
    module = getattr(value, "__module__", None) or type(value).__module__
    return module, getattr(value, "__qualname__", getattr(value, "__name__", ""))
