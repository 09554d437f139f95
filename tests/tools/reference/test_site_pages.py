from pathlib import Path

import pytest

from tools.reference.api_pages import API, api_pages
from tools.reference.examples_page import examples_page
from tools.reference.pages import generated_pages
from tools.reference.site_links import beside_docs, without_docs_folder

ROOT = Path(__file__).parents[3]
PLACES = {"README.md": "index.md", "CHANGELOG.md": "changelog.md", "examples": "examples.md"}


@pytest.mark.parametrize(
    ("link", "expected"),
    [
        ("[a](docs/map.md)", "[a](map.md)"),
        ("[a](docs/tuning.md#in-python)", "[a](tuning.md#in-python)"),
        ("![a](docs/pictures/a.png)", "![a](pictures/a.png)"),
        ("[a](CHANGELOG.md)", "[a](changelog.md)"),
        ("[a](docs/examples)", "[a](examples.md)"),
        ("[a](https://example.org/docs/x)", "[a](https://example.org/docs/x)"),
    ],
)
def test_a_page_beside_docs_is_moved_into_it(link: str, expected: str) -> None:
    assert without_docs_folder(link, PLACES) == expected


@pytest.mark.parametrize(
    ("link", "expected"),
    [
        ("[a](../README.md#top)", "[a](index.md#top)"),
        ("[a](../tuning.md)", "[a](../tuning.md)"),
        ("[a](#here)", "[a](#here)"),
    ],
)
def test_a_page_of_docs_finds_the_pages_beside_it(link: str, expected: str) -> None:
    assert beside_docs(link, PLACES) == expected


def test_each_example_is_on_the_page_of_examples() -> None:
    folder = ROOT / "docs" / "examples"
    page = examples_page(folder)
    files = [*folder.glob("*.py"), *folder.glob("*.ipynb")]
    assert files
    assert all(file.name in page for file in files)
    assert all(file.read_text(encoding="utf-8").strip() in page for file in files if file.suffix == ".py")


def test_each_package_of_the_api_can_be_imported() -> None:
    assert len(api_pages()) == len(API)
    assert all((ROOT / name.replace(".", "/") / "__init__.py").is_file() for _, names in API.values() for name in names)


def test_each_generated_page_is_in_the_navigation_of_the_site() -> None:
    navigation = (ROOT / "docs" / "site" / "mkdocs.yml").read_text(encoding="utf-8")
    assert not [place for place in generated_pages() if f": {place}\n" not in navigation]
