"""Common parts of tests of the running emulator: its start, and a client that waits for replies."""

import subprocess
from collections.abc import Callable
from typing import Protocol

import serial

from protocol.serial_port import open_serial_port

WaitUntil = Callable[[Callable[[], bool]], None]


class EmulatorProcess(Protocol):
    """What the fixture `start_emulator` starts."""

    process: subprocess.Popen[str]
    port: str

    @property
    def stderr(self) -> str: ...
    def next_line(self) -> str: ...
    def wait_for_words(self, words: str) -> None: ...


Start = Callable[..., EmulatorProcess]


def open_port(url: str, baud: int = 9600) -> serial.Serial:
    port: serial.Serial = open_serial_port(url, baud, timeout_s=10.0)
    return port


def ask(port: serial.Serial, command: bytes) -> bytes:
    port.write(command + b"\r")
    return bytes(port.read_until(b"\r"))


def wait_for_position(port: serial.Serial, reply: bytes, wait_until: WaitUntil) -> None:
    wait_until(lambda: ask(port, b"H") == reply)
