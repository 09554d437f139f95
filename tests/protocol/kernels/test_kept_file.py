"""A file is used only if it is complete, has its name and belongs to this user; otherwise only time is lost."""

import errno
import os
import threading
import time
from collections.abc import Callable
from pathlib import Path

import pytest

from protocol.kernels import kept_file
from protocol.kernels.kept_file import KERNEL, UNUSED_DAYS, cache_root, keep_file, load_file, made_by_one, prune


@pytest.fixture
def kept(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))
    prune.cache_clear()
    file = cache_root() / "kernels" / f"name{KERNEL}"
    keep_file(file, b"machine code")
    assert file.is_relative_to(tmp_path)
    return file


def test_what_was_kept_is_loaded_and_nothing_else(kept: Path) -> None:
    assert load_file(kept) == b"machine code"
    assert load_file(kept.with_name("another")) is None


def changed(file: Path) -> None:
    content = bytearray(file.read_bytes())
    content[-1] ^= 1
    file.write_bytes(content)


def cut_short(file: Path) -> None:
    file.write_bytes(file.read_bytes()[:-1])


def emptied(file: Path) -> None:
    file.write_bytes(b"")


def renamed(file: Path) -> None:
    another = file.with_name("another")
    keep_file(another, b"other code")
    another.replace(file)


def linked(file: Path) -> None:
    elsewhere = file.parent.with_name("elsewhere")
    elsewhere.mkdir()
    file.replace(elsewhere / file.name)
    file.symlink_to(elsewhere / file.name)


def a_pipe(file: Path) -> None:
    file.unlink()
    os.mkfifo(file)


def a_folder(file: Path) -> None:
    file.unlink()
    file.mkdir()


def written_by_a_group(file: Path) -> None:
    file.chmod(0o620)


def written_by_all(file: Path) -> None:
    file.chmod(0o602)


@pytest.mark.skipif(os.name != "posix", reason="users and pipes of POSIX")
@pytest.mark.parametrize(
    "damage", [changed, cut_short, emptied, renamed, linked, a_pipe, a_folder, written_by_a_group, written_by_all]
)
def test_a_file_that_cannot_be_trusted_is_not_used(kept: Path, damage: Callable[[Path], None]) -> None:
    damage(kept)
    assert load_file(kept) is None


@pytest.mark.skipif(os.name != "posix", reason="users of POSIX")
def test_a_file_of_another_user_is_not_used(kept: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    another = os.geteuid() + 1
    monkeypatch.setattr(os, "geteuid", lambda: another)
    assert load_file(kept) is None


@pytest.mark.skipif(os.name != "posix", reason="modes of POSIX")
def test_a_file_is_used_again_whatever_the_user_lets_others_write(kept: Path) -> None:
    before = os.umask(0)
    try:
        keep_file(kept, b"new code")
    finally:
        os.umask(before)
    assert load_file(kept) == b"new code"


def test_an_old_file_in_a_folder_that_cannot_be_written_is_used(kept: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def denied(_file: Path) -> None:
        raise PermissionError(errno.EROFS, "Read-only file system")

    long_ago = time.time() - 7 * 86_400
    os.utime(kept, (long_ago, long_ago))
    monkeypatch.setattr(Path, "touch", denied)
    assert load_file(kept) == b"machine code"


def test_two_that_make_a_file_take_turns(kept: Path) -> None:
    file = kept.with_name(f"made{KERNEL}")
    order: list[str] = []

    def second() -> None:
        with made_by_one(file):
            order.append(f"second finds {load_file(file)!r}")

    with made_by_one(file):
        thread = threading.Thread(target=second)
        thread.start()
        thread.join(0.2)
        order.append("first")
        keep_file(file, b"code")
    thread.join()
    assert order == ["first", "second finds b'code'"]
    assert set(kept.parent.iterdir()) == {kept, file}


def test_who_waits_for_a_process_that_does_not_go_on_makes_the_file(
    kept: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(kept_file, "PATIENCE_S", 0.1)
    entered = []
    with made_by_one(kept):
        thread = threading.Thread(target=lambda: entered.extend(_enter(kept)))
        thread.start()
        thread.join()
    assert entered == [True]


def _enter(file: Path) -> list[bool]:
    with made_by_one(file):
        return [True]


@pytest.mark.parametrize("folder", ["a file", os.devnull])
def test_where_nothing_can_be_kept_nobody_waits(tmp_path: Path, folder: str) -> None:
    (tmp_path / "a file").write_text("")
    with made_by_one(tmp_path / folder / "name"):
        pass


def test_a_user_without_a_home_keeps_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    def unknown() -> Path:
        raise RuntimeError("Could not determine home directory.")

    monkeypatch.setattr(Path, "home", unknown)
    monkeypatch.delenv("NUMBA_CACHE_DIR", raising=False)
    monkeypatch.delenv("XDG_CACHE_HOME", raising=False)
    prune.cache_clear()
    file = cache_root() / "kernels" / f"name{KERNEL}"
    keep_file(file, b"machine code")
    assert load_file(file) is None
    assert list(file.parent.glob("*")) == []


def test_a_full_disk_costs_nothing_but_time(kept: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(_file: Path, _content: bytes) -> int:
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(Path, "write_bytes", full)
    another = kept.with_name(f"another{KERNEL}")
    keep_file(another, b"machine code")
    assert load_file(another) is None
    assert list(kept.parent.iterdir()) == [kept]


def test_files_that_no_run_has_used_for_long_are_deleted(kept: Path) -> None:
    long_ago = time.time() - (UNUSED_DAYS + 1) * 86_400
    used, unused, new = (kept.with_name(f"{name}{KERNEL}") for name in ("used", "unused", "new"))
    old_layout = cache_root() / "0123456789abcdef" / "geometry_0"
    old_layout.mkdir(parents=True)
    foreign = cache_root().with_name("other") / "their.nbc"
    foreign.parent.mkdir()
    for file in (used, unused):
        keep_file(file, b"code")
    for file in (used, unused, old_layout / "old.nbc", old_layout / "old.nbi", foreign):
        file.touch()
        os.utime(file, (long_ago, long_ago))
    assert load_file(used) == b"code"
    prune.cache_clear()
    keep_file(new, b"code")
    assert set(kept.parent.iterdir()) == {kept, used, new}
    assert list(old_layout.iterdir()) == []
    assert foreign.exists()
