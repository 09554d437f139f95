"""Differential fuzzing: lines of any bytes, and triggers, to the emulator and to the compiled firmware."""

from typing import NamedTuple

from hypothesis import strategies as st
from hypothesis.strategies import SearchStrategy

from emulator.config.table_config import TableConfig
from tools.lockstep import Pair


class Sent(NamedTuple):
    """A line, without its CR, and what comes with it."""

    line: bytes
    pause_ticks: int  # before it
    is_triggered: bool  # just before it


def streams(config: TableConfig, most_lines: int) -> SearchStrategy[list[Sent]]:
    """Return lines of the protocol, lines that almost are, and any bytes."""
    limits = config.limits
    whole = st.one_of(
        st.integers(0, 9), st.integers(0, 400), st.integers(4_194_300, 4_194_310), st.integers(0, 10**20)
    ).map(str)
    bounds = st.sampled_from([f"{limits.speed_deg_s}", f"{limits.acceleration_deg_s2}", "0", "4194303.998"])
    fraction = st.text("0123456789", max_size=6).map(lambda digits: f".{digits}" if digits else "")
    near_bound = st.builds("{}{}".format, bounds, st.sampled_from(["", "0", "0000", "5"]))
    number = st.one_of(st.builds("{}{}".format, whole, fraction), near_bound)
    sign, gap = st.sampled_from(["", "", "-", "+", "--", "."]), st.sampled_from(["", " ", "   "])
    command = st.builds(
        lambda letter, before, minus, digits, after: f"{letter}{before}{minus}{digits}{after}".encode(),
        st.sampled_from("PRSAHLpQ"),
        gap,
        sign,
        number,
        gap,
    )
    reading = st.sampled_from([b"H", b"L", b"H ", b"\nH", b"L\n"])
    noise = st.binary(max_size=45).map(lambda data: data.replace(b"\r", b" "))
    line = st.one_of(command, command, reading, noise)
    return st.lists(
        st.builds(Sent, line, st.sampled_from([0, 0, 1, 7, 40, 300]), st.booleans()), min_size=1, max_size=most_lines
    )


def check_stream(config: TableConfig, stream: list[Sent], seed: int = 0) -> int:
    """Send a stream to both, one line after the reply to the last; return the number of lines.

    Raises:
        PartingError: they did not do the same.
    """
    pair = Pair(config, seed)
    for sent in stream:
        pair.step(sent.pause_ticks)
        if sent.is_triggered:
            pair.trigger()
        pair.send(sent.line)
        pair.step()
        while not pair.is_quiet:
            pair.step()
        pair.compare()
    return len(stream)
