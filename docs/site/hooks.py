"""Adds the generated pages, and those that stand beside docs/, to the site."""

from pathlib import Path

from mkdocs.config.defaults import MkDocsConfig
from mkdocs.structure.files import File, Files

from tools.reference.examples_page import examples_page
from tools.reference.pages import generated_pages
from tools.reference.site_links import beside_docs, without_docs_folder

ROOT = Path(__file__).parents[2]
BESIDE_DOCS = {"README.md": "index.md", "CONTRIBUTING.md": "contributing.md", "CHANGELOG.md": "changelog.md"}
PLACES = {**BESIDE_DOCS, "examples": "examples.md"}


def on_files(files: Files, config: MkDocsConfig) -> Files:
    """Add the pages."""
    pages = generated_pages() | {"examples.md": examples_page(ROOT / "docs" / "examples")}
    for source, place in BESIDE_DOCS.items():
        pages[place] = without_docs_folder((ROOT / source).read_text(encoding="utf-8"), PLACES)
    for place, text in pages.items():
        files.append(File.generated(config, place, content=text))
    return files


def on_page_markdown(markdown: str, **_: object) -> str:
    """Point a page's links to files beside docs/, and to the folder of examples, to their pages."""
    return beside_docs(markdown, PLACES)
