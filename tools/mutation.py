"""Small mutations of a module's source, and their application in the running program."""

import ast
import importlib
import inspect
import sys
from collections.abc import Iterator, Sequence
from types import CodeType, ModuleType
from typing import NamedTuple

MODULES = (
    "emulator.int32",
    "emulator.config.constants",
    "emulator.plant.encoder",
    "emulator.firmware.controller",
    "emulator.firmware.fixed_point",
    "emulator.table.interpreter",
    "emulator.table.control_loop",
    "emulator.firmware.pid",
    "emulator.firmware.profiler",
    "emulator.table.serial_end",
    "emulator.table.table",
    "emulator.table.trigger",
    "emulator.line.uart",
    "protocol.codec",
    "protocol.line_buffer",
)
"""The modules of the firmware of the emulated table; the suite does not test its plant."""

COMPILED = (
    "emulator.int32",
    "emulator.plant.encoder",
    "emulator.firmware.controller",
    "emulator.firmware.fixed_point",
    "emulator.firmware.pid",
    "emulator.firmware.profiler",
)
"""The modules with functions that numba compiles."""

_SWAPPED: dict[type[ast.AST], type[ast.AST]] = {
    ast.Lt: ast.LtE,
    ast.LtE: ast.Lt,
    ast.Gt: ast.GtE,
    ast.GtE: ast.Gt,
    ast.Eq: ast.NotEq,
    ast.NotEq: ast.Eq,
    ast.Is: ast.IsNot,
    ast.IsNot: ast.Is,
    ast.In: ast.NotIn,
    ast.NotIn: ast.In,
    ast.Add: ast.Sub,
    ast.Sub: ast.Add,
    ast.Mult: ast.FloorDiv,
    ast.FloorDiv: ast.Mult,
    ast.Div: ast.Mult,
    ast.LShift: ast.RShift,
    ast.RShift: ast.LShift,
    ast.BitAnd: ast.BitOr,
    ast.BitOr: ast.BitAnd,
    ast.And: ast.Or,
    ast.Or: ast.And,
}
_NAMES = {"min": "max", "max": "min"}
_SKIPPED = (ast.Raise, ast.Assert, ast.Import, ast.ImportFrom, ast.AnnAssign)


class Mutation(NamedTuple):
    """One change of a module: its function, and the statement before and after."""

    where: str
    change: str
    line: int
    module: str

    def __str__(self) -> str:
        return f"{self.where} (line {self.line}): {self.change}"


def mutations_of(modules: Sequence[str]) -> list[Mutation]:
    """Return all mutations of modules, in the order of their source."""
    return [mutation for module in modules for mutation, _ in _mutated(module)]


def planted(mutation: Mutation) -> None:
    """Make the emulator use a mutated copy of a module; the client and the kit keep the original."""
    original = importlib.import_module(mutation.module)
    mutated = ModuleType(mutation.module)
    mutated.__file__ = original.__file__
    code = next(_compiled(tree, original) for one, tree in _mutated(mutation.module) if one == mutation)
    exec(code, vars(mutated))  # noqa: S102 - the project's own code
    before = dict(vars(original))  # the module itself is changed too
    replaced = {id(value): vars(mutated)[name] for name, value in _own(original)}
    for name, user in list(sys.modules.items()):
        if name.startswith("emulator"):
            for key, value in list(vars(user).items()):
                if id(value) in replaced:
                    setattr(user, key, replaced[id(value)])
                elif key.isupper() and key in before and value == before[key]:
                    setattr(user, key, vars(mutated)[key])


def mutated_source(mutation: Mutation) -> str:
    """Return the source of a module with a mutation in it, without its comments."""
    return next(ast.unparse(tree) for one, tree in _mutated(mutation.module) if one == mutation)


def _own(module: ModuleType) -> Iterator[tuple[str, object]]:
    """Yield the functions and classes that a module defines itself."""
    for name, value in vars(module).items():
        if (inspect.isfunction(value) or inspect.isclass(value)) and value.__module__ == module.__name__:
            yield name, value


def _compiled(tree: ast.Module, module: ModuleType) -> CodeType:
    return compile(ast.fix_missing_locations(tree), str(module.__file__), "exec")


def _mutated(module: str) -> Iterator[tuple[Mutation, ast.Module]]:
    """Yield each mutation with the module's tree, which contains it until the next one is requested."""
    tree = ast.parse(inspect.getsource(importlib.import_module(module)))
    for where, statement in _statements(tree, module):
        before = ast.unparse(statement).partition("\n")[0]
        for node in list(_nodes(statement)):
            for undo in _changes(node):
                after = ast.unparse(statement).partition("\n")[0]
                yield Mutation(where, f"{before} -> {after}", statement.lineno, module), tree
                undo()


def _statements(tree: ast.AST, where: str) -> Iterator[tuple[str, ast.stmt]]:
    """Yield the statements within functions, and constants of the module, each with its place."""
    for child in ast.iter_child_nodes(tree):
        if isinstance(child, ast.FunctionDef | ast.ClassDef):
            yield from _statements(child, f"{where}.{child.name}")
        elif isinstance(child, ast.stmt) and not isinstance(child, _SKIPPED) and not _is_docstring(child):
            yield where, child
            if not isinstance(child, ast.Expr | ast.Assign | ast.AugAssign | ast.Return):
                yield from _statements(child, where)


def _is_docstring(statement: ast.stmt) -> bool:
    return isinstance(statement, ast.Expr) and isinstance(statement.value, ast.Constant)


def _nodes(statement: ast.stmt) -> Iterator[ast.AST]:
    """Yield a statement and its expressions, without the statements within it."""
    yield statement
    for child in ast.iter_child_nodes(statement):
        if isinstance(child, ast.expr | ast.withitem | ast.match_case):
            yield from (node for node in ast.walk(child) if not isinstance(node, ast.stmt))


def _changes(node: ast.AST) -> Iterator["Undo"]:
    """Apply each possible change to a node, and yield the function that undoes it."""
    for field in ("op", "ops"):
        operator = getattr(node, field, None)
        first = operator[0] if isinstance(operator, list) else operator
        if isinstance(first, ast.AST) and type(first) in _SWAPPED:
            swapped = _SWAPPED[type(first)]()
            yield Undo(node, field, [swapped, *operator[1:]] if isinstance(operator, list) else swapped)
    if isinstance(node, ast.Constant) and isinstance(node.value, int | float):
        other = not node.value if isinstance(node.value, bool) else node.value + 1
        yield Undo(node, "value", other)
    if isinstance(node, ast.Name) and node.id in _NAMES:
        yield Undo(node, "id", _NAMES[node.id])
    if isinstance(node, ast.If | ast.While | ast.IfExp):
        yield Undo(node, "test", ast.UnaryOp(ast.Not(), node.test))
    if isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.USub):
        yield Undo(node, "op", ast.UAdd())
    if isinstance(node, ast.Expr) and isinstance(node.value, ast.Call):
        yield Undo(node, "value", ast.Constant(None))


class Undo:
    """A change of one field of a node, made at once; a call undoes it."""

    def __init__(self, node: ast.AST, field: str, value: object) -> None:
        self._node, self._field, self._before = node, field, getattr(node, field)
        setattr(node, field, value)

    def __call__(self) -> None:
        """Undo the change."""
        setattr(self._node, self._field, self._before)
