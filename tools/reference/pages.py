"""All generated pages of the docs site."""

from tools.reference.api_pages import api_pages
from tools.reference.command_pages import command_pages
from tools.reference.planner_keys import planner_pages
from tools.reference.profile_keys import profile_page
from tools.reference.table_keys import table_page


def generated_pages() -> dict[str, str]:
    """Return the Markdown of each generated page, by its path in the docs."""
    keys = {"keys-table.md": table_page(), "keys-profile.md": profile_page(), **planner_pages(), **api_pages()}
    commands = {f"commands/{name}": text for name, text in command_pages().items()}
    return {f"reference/{name}": text for name, text in (keys | commands).items()}
