"""Pages of the Python API: for mkdocstrings, which reads signatures and docstrings from the source."""

from collections.abc import Mapping, Sequence

API: Mapping[str, tuple[str, Sequence[str]]] = {
    "protocol": ("The client, the codec and the errors of the protocol.", ("protocol",)),
    "emulator": ("The table in the same process, its configuration and its faults.", ("emulator", "emulator.faults")),
    "planner": ("From a scan to a verified run; see also [the planner from Python](../api.md).", ("planner",)),
    "tuning": ("Plant, loop and gains as LTI objects; see also [tuning](../tuning.md#in-python).", ("tools.tuning",)),
}
"""Each page: its subject, and the packages whose public names it lists."""


def api_pages() -> dict[str, str]:
    """Return the Markdown of the pages, by file name."""
    return {
        f"api-{name}.md": f"# {packages[0]}\n\n{text}\n\n" + "\n".join(f"::: {package}\n" for package in packages)
        for name, (text, packages) in API.items()
    }
