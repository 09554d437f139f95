"""Building the firmware, and the simulator's library, with the compilers of the distribution.

Build results are stored in the user's cache folder under a digest of all their inputs. A result appears there only when
it is complete. It is used only if no other user can have written it, since it is machine code.
"""

import hashlib
import os
import subprocess
from contextlib import suppress
from functools import cache
from pathlib import Path
from shutil import which
from tempfile import TemporaryDirectory

from emulator.avr.errors import ToolchainError
from emulator.avr.header import header_text
from emulator.config.table_config import TableConfig
from protocol.files.whole_file import whole_file
from protocol.kernels.kept_file import cache_root, is_own, prune

FIRMWARE = Path(__file__).with_name("firmware")
CONSTANTS = FIRMWARE / "table_constants.h"
_SHIM = Path(__file__).with_name("host") / "chip.c"
_GAINS = "gains.h"
_LONGEST_REASON = 300
_HEADERS = Path("/usr/include/simavr/sim_avr.h")
_INSTALL = "install the packages gcc, gcc-avr, avr-libc and libsimavr-dev (apt-get install ...)"

COMPILE = (
    *("avr-gcc", "-mmcu=atmega328p", "-DF_CPU=16000000UL", "-std=gnu99", "-O2"),
    *("-Wall", "-Wextra", "-Wconversion", "-Wstrict-prototypes", "-Wmissing-prototypes", "-Wshadow", "-Werror"),
    *("-ffunction-sections", "-fdata-sections", "-Wl,--gc-sections,--undefined=table_digest"),
)
_COMPILE_SHIM = ("gcc", "-std=gnu11", "-O2", "-Wall", "-Wextra", "-Werror", "-shared", "-fPIC", "-I/usr/include/simavr")


def lacking() -> str:
    """Return what this machine lacks to build the firmware and run it, or nothing."""
    for program in ("avr-gcc", "avr-objcopy", "gcc"):
        if which(program) is None:
            return f"{program} is not installed; {_INSTALL}"
    if not _has_avr_libc():
        return f"avr-libc is not installed; {_INSTALL}"
    return "" if _HEADERS.is_file() else f"libsimavr-dev is not installed; {_INSTALL}"


def build_firmware(config: TableConfig, sources: Path = FIRMWARE, gains: Path | None = None) -> Path:
    """Return the ELF file of the firmware for a configured table.

    Args:
        config: the table.
        sources: the folder of the firmware's sources.
        gains: `gains.h` of `tools.tune`, in place of the configured gains.

    Raises:
        ConfigError: the controller cannot run such a table.
        ToolchainError: it cannot be built, or a file cannot be read.
    """
    files = {source.name: source.read_bytes() for source in sorted(sources.glob("*.[ch]"))}
    files[CONSTANTS.name] = header_text(config, "a table's configuration").encode("ascii")
    options = list(COMPILE)
    if gains is not None:
        files[_GAINS] = _gains_source(gains)
        options += ["-include", _GAINS]
    digest = hashlib.sha256(f"{_version('avr-gcc')}{options}".encode())
    for name, content in files.items():
        digest.update(f"{name} {len(content)}\n".encode() + content)
    built = _folder() / f"table-{digest.hexdigest()[:24]}.elf"
    if not _is_kept(built):
        with TemporaryDirectory() as folder:
            for name, content in files.items():
                (Path(folder) / name).write_bytes(content)
            _compile(built, [*options, *(name for name in files if name.endswith(".c"))], Path(folder))
    return built


def build_simulator() -> Path:
    """Return the shared library that runs the firmware.

    Raises:
        ToolchainError: it cannot be built.
    """
    digest = hashlib.sha256(_SHIM.read_bytes())
    for part in (_version("gcc"), " ".join(_COMPILE_SHIM)):
        digest.update(part.encode())
    built = _folder() / f"chip-{digest.hexdigest()[:24]}.so"
    if not _is_kept(built):
        _compile(built, [*_COMPILE_SHIM, _SHIM.name, "-lsimavr", "-lm"], _SHIM.parent)
    return built


def _folder() -> Path:
    folder = cache_root() / "firmware"
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise ToolchainError(f"{folder}: cannot create the folder: {error.strerror}; set XDG_CACHE_HOME") from error
    return folder


def _is_kept(built: Path) -> bool:
    try:
        status = built.lstat()
    except OSError:
        return False
    if not is_own(status) or not status.st_size:
        return False
    with suppress(OSError):  # a folder that can only be read
        built.touch()  # it is in use; see `prune`
    return True


def _gains_source(file: Path) -> bytes:
    """Return `gains.h`, and after it a line that does not compile unless it was one."""
    try:
        content = file.read_bytes()
    except OSError as error:
        raise ToolchainError(f"{file}: {error.strerror}; name a gains.h of `python -m tools.tune`") from error
    return content + f'\n#ifndef TABLE_GAINS_H\n#error "{_GAINS} is not one of tools.tune"\n#endif\n'.encode()


def _compile(built: Path, command: list[str], folder: Path) -> None:
    prune(cache_root())
    try:
        with whole_file(built) as partial:
            subprocess.run(  # noqa: S603  # the command is ours
                [*command, "-o", str(partial.absolute())],
                check=True,
                capture_output=True,
                text=True,
                errors="replace",
                cwd=folder,
                env=os.environ | {"LC_ALL": "C"},
            )
            partial.chmod(0o700)
    except FileNotFoundError as error:
        raise ToolchainError(f"{command[0]} is not installed; {_INSTALL}") from error
    except subprocess.CalledProcessError as error:
        raise ToolchainError(f"{command[0]} failed: {_first_error(error.stderr)}") from error
    except OSError as error:
        raise ToolchainError(f"{built}: {error.strerror}; set XDG_CACHE_HOME to a folder with room") from error


def _first_error(printed: str) -> str:
    """Return what a compiler complains of first, as one line."""
    lines = [line for line in printed.splitlines() if line.strip()]
    first = next((line for line in lines if "error:" in line), lines[0] if lines else "it gives no reason")
    is_missing = "No such file" in first or "cannot find" in printed
    text = "".join(letter if letter.isprintable() else "?" for letter in first[:_LONGEST_REASON])
    return text + (f"; {_INSTALL}" if is_missing else "")


def _has_avr_libc() -> bool:
    """Return whether the start-up code of the controller is there: without it the compiler prints the bare name."""
    start = "crtatmega328p.o"
    asked = ["avr-gcc", "-mmcu=atmega328p", f"-print-file-name={start}"]
    printed = subprocess.run(asked, check=False, capture_output=True, text=True).stdout.strip()  # noqa: S603  # a compiler
    return printed not in {"", start}


def _version(compiler: str) -> str:
    path = which(compiler)
    if path is None:
        raise ToolchainError(f"{compiler} is not installed; {_INSTALL}")
    return _version_of(path)


@cache
def _version_of(path: str) -> str:
    try:
        return subprocess.run([path, "--version"], check=True, capture_output=True, text=True).stdout  # noqa: S603  # a compiler
    except (OSError, subprocess.CalledProcessError) as error:
        raise ToolchainError(f"{path} does not run: {error}; {_INSTALL}") from error
