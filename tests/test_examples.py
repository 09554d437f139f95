"""Every example in docs/examples runs, and prints its expected output."""

import ast
import json
import os
import re
import runpy
import subprocess
import sys
from pathlib import Path
from typing import Any

import matplotlib as mpl
import pytest

FOLDER = Path(__file__).parents[1] / "docs" / "examples"
EXPECTED = {
    "01_table_in_ten_lines": r"stands at 90\.0 deg",
    "02_asyncio_client": r"Ok\(\)\nstands at 45\.0 deg",
    "03_pytest_fixture": r"2 passed",
    "04_fault": r"no reply: .*\nanswers again: 10\.0 deg",
    "05_plan_by_api": r"executable: True\n.*\nverified: within 0\.\d+ deg",
    "06_own_factor": r"\d+ cells have the reason 'excluded by low elbow'",
    "07_own_planner": r"constant_speed +cost \d+\.\d\d, .*\ndynamic_programming +cost \d+\.\d\d, executable: True",
    "08_own_arm": r"shipped arms: kuka_kr6_r700, viper_s650.*\nAdept Viper s650 +\d.*\nmine +[1-9]",
    "09_gains_by_python_control": r"gain margin \d.* dB, phase margin \d+ deg, Ms 1\.\d",
    "10_scan_in_a_notebook": r"verified: within 0\.\d+ deg",
    "11_stream_poses": r"verified: within 0\.\d+ deg .*(.*\n)*tracked +30 of 30 locations",
}
"""The expected content of the output of each, by the name of the file without its suffix."""


@pytest.fixture(autouse=True)
def _in_an_empty_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("PYTHONPATH", str(FOLDER.parents[1]))


def test_the_examples_are_numbered_and_each_is_run() -> None:
    files = sorted(file for file in FOLDER.iterdir() if file.suffix in (".py", ".ipynb"))
    assert [file.stem for file in files] == list(EXPECTED)
    assert [file.name[:3] for file in files] == [f"{number:02d}_" for number in range(1, len(files) + 1)]


@pytest.mark.parametrize("name", [name for name in EXPECTED if (FOLDER / f"{name}.py").exists()])
def test_an_example_prints_what_it_shows(name: str, capsys: pytest.CaptureFixture[str]) -> None:
    if name == "03_pytest_fixture":
        shown = pytest_output(FOLDER / f"{name}.py")
    else:
        runpy.run_path(str(FOLDER / f"{name}.py"), run_name="__main__")
        shown = capsys.readouterr().out
    assert re.search(EXPECTED[name], shown), shown


def test_the_notebook_runs_from_top_to_bottom(capsys: pytest.CaptureFixture[str]) -> None:
    mpl.use("Agg")
    name = "10_scan_in_a_notebook"
    notebook = json.loads((FOLDER / f"{name}.ipynb").read_text(encoding="utf-8"))
    assert notebook["nbformat"] == 4
    names: dict[str, Any] = {}
    for cell in notebook["cells"]:
        if cell["cell_type"] == "code":
            assert not cell["outputs"], "outputs are not kept in the repository"
            run_cell("".join(cell["source"]), names)
    shown = capsys.readouterr().out
    assert re.search(EXPECTED[name], shown), shown


def run_cell(source: str, names: dict[str, Any]) -> None:
    """Run a cell as a notebook does: the value of a last expression is shown."""
    body = ast.parse(source)
    last = body.body.pop() if isinstance(body.body[-1], ast.Expr) else None
    exec(compile(body, "cell", "exec"), names)  # noqa: S102  # our own notebook
    if isinstance(last, ast.Expr):
        print(eval(compile(ast.Expression(last.value), "cell", "eval"), names))  # noqa: S307, T201  # the same


def pytest_output(file: Path) -> str:
    command = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", str(file), "-c", os.devnull]
    return subprocess.run(command, capture_output=True, text=True, check=False, timeout=120).stdout
