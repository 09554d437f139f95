"""Links of the repository's pages, which work on a folder of files, as the site needs them."""

import re
from collections.abc import Callable, Mapping


def without_docs_folder(markdown: str, pages: Mapping[str, str]) -> str:
    """Return a page that stands beside docs/ as if it stood in it.

    Args:
        markdown: The page.
        pages: The places in the site of the pages beside docs/, by their file names.
    """
    return _links(markdown, lambda link: link.removeprefix("docs/"), pages)


def beside_docs(markdown: str, pages: Mapping[str, str]) -> str:
    """Return a page of docs/ with links to the pages beside it; see `without_docs_folder`."""

    def moved(link: str) -> str:
        name = link.removeprefix("../")
        return name if name in pages else link

    return _links(markdown, moved, pages)


def _links(markdown: str, moved: Callable[[str], str], pages: Mapping[str, str]) -> str:
    def replace(match: re.Match[str]) -> str:
        file, anchor = moved(match[1]), match[2] or ""
        return f"]({pages.get(file, file)}{anchor})"

    return re.sub(r"\]\((?!https?:)([^)#\s]+)(#[^)]*)?\)", replace, markdown)
