"""The page of the numbered examples, with their source."""

import ast
from pathlib import Path


def examples_page(folder: Path) -> str:
    """Return the Markdown of a page with each example: its first line as heading, its source, or a link to it."""
    parts = ["# Examples", "Each example is run by the tests. It is a separate file in `docs/examples/`."]
    for number, file in enumerate(sorted(path for path in folder.iterdir() if path.suffix in {".py", ".ipynb"}), 1):
        if file.suffix == ".py":
            source = file.read_text(encoding="utf-8")
            title = (ast.get_docstring(ast.parse(source)) or file.stem).splitlines()[0].removesuffix(".")
            parts += [f"## {number}. {title}", f"`{file.name}`", f"```python\n{source.strip()}\n```"]
        else:
            title = file.stem.lstrip("0123456789_").replace("_", " ").capitalize()
            parts += [f"## {number}. {title}", f"A notebook: [{file.name}](examples/{file.name})."]
    return "\n\n".join(parts) + "\n"
