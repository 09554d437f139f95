"""The keys of a table's configuration file and of its faults, from the sections that read them."""

from emulator.config.table_config import DEFAULT_FILE, load_config
from emulator.faults.fault import KINDS, help_of, parameters_of
from emulator.faults.parameter import Parameter
from tools.reference.keys import Key, comments, key_page
from tools.reference.markdown import code, table
from tools.reference.recorded_keys import recorded_keys

_INTRODUCTION = """A file for `python -m emulator --config` and for `emulator://?config=`. It needs only the keys
that
differ from the default table. The column "notes" shows the comment of the shipped file: often the source of a value."""


def table_page() -> str:
    """Return the page of the table's constants and of `[[faults]]`."""
    return key_page("Keys of a table", _INTRODUCTION, table_keys()) + "\n" + _faults()


def table_keys() -> list[Key]:
    """Return the keys of every section."""
    notes = comments(DEFAULT_FILE.read_text(encoding="utf-8"))
    return [key._replace(notes=notes.get(key.name, "")) for key in recorded_keys(load_config).values()]


def _faults() -> str:
    rows = [(code(kind), help_of(kind), "; ".join(map(_parameter, parameters_of(kind)))) for kind in KINDS]
    return "\n\n".join(
        (
            "## `[[faults]]`",
            "Each fault is one such section: its name in the key `fault`, and the keys below.",
            table(("`fault`", "effect", "keys"), rows),
        )
    )


def _parameter(entry: Parameter) -> str:
    return f"{code(entry.name)}: {entry.allowed}, {entry.help}"
