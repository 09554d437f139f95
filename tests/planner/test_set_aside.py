from pathlib import Path

import pytest

from planner.errors import PlannerError
from planner.set_aside import set_aside

NAMES = ("run.json", "run.csv")


def write(folder: Path, **texts: str) -> None:
    folder.mkdir(exist_ok=True)
    for name, text in texts.items():
        (folder / name.replace("_", ".")).write_text(text)


def texts(folder: Path) -> dict[str, str]:
    return {file.name: file.read_text() for file in folder.iterdir() if file.is_file()}


def test_former_results_are_kept_in_a_subfolder_and_others_stay(tmp_path: Path) -> None:
    write(tmp_path, run_json="a", run_csv="b", notes_txt="mine")
    set_aside(tmp_path, NAMES)
    assert texts(tmp_path) == {"notes.txt": "mine"}
    assert texts(tmp_path / "previous") == {"run.json": "a", "run.csv": "b"}


def test_the_last_results_replace_those_before_as_a_whole_set(tmp_path: Path) -> None:
    write(tmp_path, run_json="a", run_csv="b")
    set_aside(tmp_path, NAMES)
    write(tmp_path / "previous", notes_txt="mine")
    write(tmp_path, run_json="c")
    set_aside(tmp_path, NAMES)
    assert texts(tmp_path / "previous") == {"run.json": "c", "notes.txt": "mine"}


def test_a_folder_without_results_is_left_alone(tmp_path: Path) -> None:
    set_aside(tmp_path / "none", NAMES)
    write(tmp_path, notes_txt="mine")
    set_aside(tmp_path, NAMES)
    assert [file.name for file in tmp_path.iterdir()] == ["notes.txt"]


def test_what_the_command_reads_stays_where_it_is(tmp_path: Path) -> None:
    write(tmp_path, run_json="a", run_csv="b")
    (tmp_path / "link").symlink_to(tmp_path)
    set_aside(tmp_path, NAMES, keep=[tmp_path / "link" / "run.json", tmp_path / "missing"])
    assert texts(tmp_path) == {"run.json": "a"}


def test_what_the_command_reads_from_the_former_results_is_not_overwritten(tmp_path: Path) -> None:
    write(tmp_path, run_json="a")
    set_aside(tmp_path, NAMES)
    write(tmp_path, run_json="c")
    with pytest.raises(PlannerError, match="choose another folder"):
        set_aside(tmp_path, NAMES, keep=[tmp_path / "previous" / "run.json"])
    assert texts(tmp_path / "previous") == {"run.json": "a"}
    assert texts(tmp_path) == {"run.json": "c"}
