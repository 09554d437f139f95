import secrets
from pathlib import Path

import pytest

from protocol.files.whole_file import whole_file, write_whole


def test_a_file_appears_under_its_name_when_it_is_whole(tmp_path: Path) -> None:
    with whole_file(tmp_path / "a.txt") as partial:
        partial.write_text("whole")
        assert not (tmp_path / "a.txt").exists()
    assert [file.name for file in tmp_path.iterdir()] == ["a.txt"]


def test_a_text_is_written_as_utf_8(tmp_path: Path) -> None:
    write_whole(tmp_path / "a.txt", "24.8 µm\n")
    assert (tmp_path / "a.txt").read_bytes() == "24.8 µm\n".encode()


def test_an_interrupted_file_leaves_what_was_there_and_nothing_else(tmp_path: Path) -> None:
    (tmp_path / "a.txt").write_text("before")

    def write_half() -> None:
        with whole_file(tmp_path / "a.txt") as partial:
            partial.write_text("half")
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        write_half()
    assert [file.read_text() for file in tmp_path.iterdir()] == ["before"]


def test_a_link_in_the_place_of_the_partial_file_is_not_followed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(secrets, "token_hex", lambda _size: "guessed")
    (tmp_path / "thesis.tex").write_text("three years of work")
    (tmp_path / ".a.guessed.partial.txt").symlink_to(tmp_path / "thesis.tex")
    with pytest.raises(FileExistsError):
        write_whole(tmp_path / "a.txt", "x")
    assert (tmp_path / "thesis.tex").read_text() == "three years of work"
    assert not (tmp_path / "a.txt").exists()
