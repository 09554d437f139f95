"""A page for each program: its usage, options and examples, from its own argument parser."""

import argparse
from collections.abc import Iterator, Mapping
from importlib import import_module

from seventh_axis.__main__ import COMMANDS
from tools.reference.markdown import code, table

_IN_THE_WHEEL = ("tools.demo", "tools.figures")
_IN_A_CLONE = ("tools.bench.__main__", "tools.soak", "tools.mutants", "tools.mutation_score")


def programs() -> dict[str, argparse.ArgumentParser]:
    """Return the parser of every program, by its module without `__main__`: first those of `seventh-axis`."""
    modules = (*dict.fromkeys(command.module for command in COMMANDS.values()), *_IN_THE_WHEEL, *_IN_A_CLONE)
    return {module.removesuffix(".__main__"): import_module(module).parser() for module in modules}


def command_pages() -> dict[str, str]:
    """Return the Markdown of each program's page, by its file name."""
    return {f"{module.replace('.', '-')}.md": page(module, parser) for module, parser in programs().items()}


def page(module: str, parser: argparse.ArgumentParser) -> str:
    """Return a program's page; each of its commands has a section."""
    names = [name for name, command in COMMANDS.items() if command.module.removesuffix(".__main__") == module]
    parts = [f"# {parser.prog}"]
    if names:
        parts.append(f"The same program: {', '.join(code(f'seventh-axis {name}') for name in names)}.")
    if module in {each.removesuffix(".__main__") for each in _IN_A_CLONE}:
        parts.append("It needs a clone: the wheel does not contain it.")
    parts += _section(parser)
    for name, command in subcommands(parser).items():
        parts += [f"## {name}", *_section(command)]
    return "\n\n".join(parts) + "\n"


def subcommands(parser: argparse.ArgumentParser) -> Mapping[str, argparse.ArgumentParser]:
    """Return the commands of a program, by name; none for a program without commands."""
    for action in parser._actions:  # noqa: SLF001  # argparse has no public view of its actions
        if isinstance(action, argparse._SubParsersAction):  # noqa: SLF001  # the type of what add_subparsers returns
            return dict(action.choices)
    return {}


def options(parser: argparse.ArgumentParser) -> Iterator[argparse.Action]:
    """Yield the options and arguments that the help of a parser shows, without its commands."""
    for action in parser._actions:  # noqa: SLF001  # as above
        if action.help is not argparse.SUPPRESS and not isinstance(action, argparse._SubParsersAction):  # noqa: SLF001
            yield action


def _section(parser: argparse.ArgumentParser) -> Iterator[str]:
    yield parser.description or ""
    yield f"```text\n{parser.format_usage().strip()}\n```"
    yield table(("option", "meaning"), ((_name(action), _help(parser, action)) for action in options(parser)))
    if parser.epilog:
        yield f"```text\n{parser.epilog.strip() % {'prog': parser.prog}}\n```"


def _name(action: argparse.Action) -> str:
    if not action.option_strings:
        return code(str(action.metavar or action.dest))
    value = "" if action.nargs == 0 else f" {_value(action)}"
    return code(", ".join(action.option_strings) + value)


def _value(action: argparse.Action) -> str:
    if action.metavar is not None:
        return " ".join(action.metavar) if isinstance(action.metavar, tuple) else action.metavar
    return "{" + ",".join(map(str, action.choices)) + "}" if action.choices is not None else action.dest.upper()


def _help(parser: argparse.ArgumentParser, action: argparse.Action) -> str:
    text = (action.help or "") % (vars(action) | {"prog": parser.prog})
    return text + ("; required" if action.required and action.option_strings else "")
