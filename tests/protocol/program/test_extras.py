"""A program with a missing extra states which one to install, and how."""

import os
import re
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

from protocol.program.extras import EXTRAS, missing_extra

ROOT = Path(__file__).parents[3]
DISTRIBUTIONS = {"xdist": "pytest-xdist"}
"""Where the module has another name than what installs it."""

WITHOUT_EXTRAS = f"""
import sys

class Missing:
    def find_spec(self, name, path=None, target=None):
        if name.partition(".")[0] in {sorted(module for modules in EXTRAS.values() for module in modules)}:
            raise ModuleNotFoundError(f"No module named {{name!r}}", name=name)

sys.meta_path.insert(0, Missing())
"""


def test_each_extra_has_the_modules_that_the_project_file_says() -> None:
    extras = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]["optional-dependencies"]
    for extra, modules in EXTRAS.items():
        named = {re.split(r"[>=\[]", requirement)[0].replace("-", "_") for requirement in extras[extra]}
        assert {DISTRIBUTIONS.get(module, module).replace("-", "_") for module in modules} == named - {"seventh_axis"}


def test_only_a_missing_module_of_an_extra_is_explained() -> None:
    assert missing_extra(ModuleNotFoundError("", name="scipy.special")).startswith("scipy is not installed: ")
    assert missing_extra(ModuleNotFoundError("", name="planner.nothing")) == ""
    assert missing_extra(ImportError("", name="numpy")) == ""
    assert missing_extra(ValueError()) == ""


@pytest.fixture(scope="module")
def bare(tmp_path_factory: pytest.TempPathFactory) -> dict[str, str]:
    """An environment in which no extra is installed."""
    folder = tmp_path_factory.mktemp("bare")
    (folder / "sitecustomize.py").write_text(WITHOUT_EXTRAS, encoding="utf-8")
    return os.environ | {"PYTHONPATH": os.pathsep.join([str(folder), str(ROOT)])}


def run(words: list[str], environment: dict[str, str], folder: Path) -> subprocess.CompletedProcess[str]:
    front_door = str(Path(sys.executable).with_name("seventh-axis"))
    command = [front_door, *words[1:]] if words[0] == "seventh-axis" else [sys.executable, "-m", *words]
    return subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True, check=False, timeout=60)


@pytest.mark.parametrize(
    ("words", "program", "extra"),
    [
        (["planner", "map", "mould", "--out", "out"], "planner", "planner"),
        (["tools.tune", "--out", "out"], "tune", "tools"),
        (["tools.identify", "fit", "trace.csv", "--out", "table.toml"], "identify", "planner"),
        (["tools.plot_trace", "run.csv", "--out", "run.png"], "plot_trace", "planner"),
        (["seventh-axis", "plan", "cylinder", "--out", "out"], "seventh-axis plan", "planner"),
        (["seventh-axis", "tune", "--out", "out"], "seventh-axis tune", "tools"),
    ],
    ids=lambda value: "-".join(value[:2]) if isinstance(value, list) else None,
)
def test_a_missing_extra_is_one_line_and_status_2(
    words: list[str], program: str, extra: str, bare: dict[str, str], tmp_path: Path
) -> None:
    done = run(words, bare, tmp_path)
    assert done.returncode == 2
    assert re.fullmatch(
        rf"{program}: \w+ is not installed: needs 'seventh-axis\[{extra}\]';"
        rf" run: pip install 'seventh-axis\[{extra}\]'\n",
        done.stderr,
    ), done.stderr


@pytest.mark.parametrize(
    "words",
    [
        ["emulator", "--help"],
        ["planner", "plan", "--help"],
        ["protocol.conformance", "--list"],
        ["seventh-axis", "--help"],
        ["seventh-axis", "table", "--help"],
    ],
    ids=lambda words: "-".join(words[:2]),
)
def test_what_needs_no_extra_works_without(words: list[str], bare: dict[str, str], tmp_path: Path) -> None:
    done = run(words, bare, tmp_path)
    assert done.returncode == 0, done.stderr


def test_another_exception_keeps_its_traceback(bare: dict[str, str], tmp_path: Path) -> None:
    (tmp_path / "sitecustomize.py").write_text(
        "import sys\nsys.modules['planner.commands.command_line'] = None\n", encoding="utf-8"
    )
    environment = bare | {"PYTHONPATH": os.pathsep.join([str(tmp_path), str(ROOT)])}
    done = run(["planner", "--help"], environment, tmp_path)
    assert done.returncode == 1
    assert "Traceback" in done.stderr
