"""Convert links of the repository's pages, which are for a folder of files, to links of the site."""

import re
from collections.abc import Callable, Mapping


def without_docs_folder(markdown: str, pages: Mapping[str, str]) -> str:
    """Return a page beside docs/ with its links as if it were inside docs/.

    Args:
        markdown: the page.
        pages: the paths in the site of the pages beside docs/, by their file names.
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
