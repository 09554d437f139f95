"""Building: what is missing is named, and nothing is left half built."""

import os
from pathlib import Path

import pytest

from emulator.avr.errors import ToolchainError
from emulator.avr.toolchain import build_firmware, build_simulator, lacking
from emulator.config.table_config import load_config
from tests.emulator.avr.toolchain_mark import needs_toolchain


@pytest.fixture
def no_compilers(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setenv("PATH", str(tmp_path))
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    monkeypatch.delenv("NUMBA_CACHE_DIR", raising=False)


@pytest.mark.usefixtures("no_compilers")
def test_a_missing_compiler_is_named_with_its_packages() -> None:
    assert "avr-gcc is not installed; install the packages gcc, gcc-avr" in lacking()
    with pytest.raises(ToolchainError, match="avr-gcc is not installed; install the packages"):
        build_firmware(load_config())
    with pytest.raises(ToolchainError, match="gcc is not installed; install the packages"):
        build_simulator()


@needs_toolchain
def test_a_source_that_does_not_compile_leaves_nothing(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    monkeypatch.delenv("NUMBA_CACHE_DIR", raising=False)
    (tmp_path / "main.c").write_text("int main(void) { return nothing; }", encoding="ascii")
    with pytest.raises(ToolchainError, match="nothing"):
        build_firmware(load_config(), tmp_path)
    assert list((tmp_path / "cache" / "seventh-axis" / "firmware").iterdir()) == []


@needs_toolchain
def test_gains_for_another_tick_are_refused(tmp_path: Path) -> None:
    gains = tmp_path / "gains.h"
    gains.write_text(
        "#define TABLE_GAINS_H\n#define GAINS_TICK_HZ 500L\n#define GAINS_SPEED_WINDOW_TICKS 8L\n"
        "#define GAINS_DUTY_MAX 1023L\n",
        encoding="ascii",
    )
    with pytest.raises(ToolchainError, match=r"gains\.h is for another tick, window or PWM"):
        build_firmware(load_config(), gains=gains)


@needs_toolchain
@pytest.mark.parametrize(
    ("content", "words"),
    [
        (b"", r"gains\.h is not one of tools\.tune"),
        (b"#define GAINS_RAMP_PROPORTIONAL 5L\n", r"gains\.h"),
        (b"\xf4\x00\xff \x1b[31m\r\n" * 30, r"gains\.h"),
        (None, r"No such file or directory; name a gains\.h"),
    ],
)
def test_a_file_that_is_no_gains_file_is_refused_in_one_line(content: bytes | None, words: str, tmp_path: Path) -> None:
    gains = tmp_path / "gains.h"
    if content is not None:
        gains.write_bytes(content)
    with pytest.raises(ToolchainError, match=words) as refusal:
        build_firmware(load_config(), gains=gains)
    assert str(refusal.value).isprintable()


@needs_toolchain
def test_a_compiler_without_the_library_is_named(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    compiler = tmp_path / "avr-gcc"
    compiler.write_text("#!/bin/sh\necho crtatmega328p.o\n", encoding="ascii")
    compiler.chmod(0o755)
    monkeypatch.setenv("PATH", f"{tmp_path}:{os.environ['PATH']}")
    assert "avr-libc is not installed" in lacking()


@needs_toolchain
@pytest.mark.parametrize("spoiled", ["empty", "writable for others", "a link"])
def test_a_kept_file_that_another_may_have_made_is_built_again(
    spoiled: str, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    monkeypatch.delenv("NUMBA_CACHE_DIR", raising=False)
    for build in (build_simulator, lambda: build_firmware(load_config())):
        built = build()
        good = built.read_bytes()
        if spoiled == "empty":
            built.write_bytes(b"")
        elif spoiled == "a link":
            (other := tmp_path / "other").write_bytes(b"not ours")
            built.unlink()
            built.symlink_to(other)
        else:
            built.write_bytes(b"not ours")
            built.chmod(0o777)
        assert build() == built
        assert not built.is_symlink()
        assert built.read_bytes() == good


@needs_toolchain
def test_what_was_built_is_kept() -> None:
    built = build_firmware(load_config())
    assert build_firmware(load_config()) == built
    assert built.is_file()
