import errno
import resource
import signal
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import IO

import numpy as np
import pytest

from emulator.config.table_config import load_config
from emulator.table.table import Table
from emulator.trace import TraceError, TraceWriter, read_trace

TICK_HZ = 1000


def record(path: Path, ticks: int = 2000) -> Table:
    table = Table(load_config())
    with TraceWriter(path, TICK_HZ) as trace:
        table.observer = trace.record
        table.advance(100)
        table.receive(b"P 3\rH\r")
        table.advance(ticks)
    return table


@pytest.mark.parametrize("name", ["run.csv", "run.npz"])
def test_a_trace_holds_the_whole_run(tmp_path: Path, name: str) -> None:
    path = tmp_path / name
    table = record(path)
    trace = read_trace(path)
    assert trace.time_s[-1] == table.tick / TICK_HZ
    assert trace.encoder_deg[-1] == table.status().encoder_deg
    assert trace.reference_deg[-1] == pytest.approx(3.0)
    assert np.abs(trace.true_speed_deg_s).max() > 5.0
    assert b"".join(trace.received) == b"P 3\rH\r"
    assert b"".join(trace.transmitted) == b"OK\rH 0.0\r"
    assert set(trace.gain_set) == {"ramp", "hold"}
    assert {"idle", "moving"} <= set(trace.state)


def test_both_formats_hold_the_same_to_the_last_bit(tmp_path: Path) -> None:
    record(tmp_path / "run.csv")
    record(tmp_path / "run.npz")
    one, other = read_trace(tmp_path / "run.csv"), read_trace(tmp_path / "run.npz")
    for name in one._fields:
        assert list(getattr(one, name)) == list(getattr(other, name))


def test_the_same_run_gives_the_same_bytes(tmp_path: Path) -> None:
    record(tmp_path / "one.csv")
    record(tmp_path / "other.csv")
    assert (tmp_path / "one.csv").read_bytes() == (tmp_path / "other.csv").read_bytes()


def test_the_header_names_columns_with_their_units(tmp_path: Path) -> None:
    record(tmp_path / "run.csv")
    header = (tmp_path / "run.csv").read_text().splitlines()[0]
    assert header.startswith("time_s,reference_deg,encoder_deg,true_deg,reference_speed_deg_s,")
    assert header.endswith("current_A,duty,gain_set,state,received,transmitted")


def test_every_tick_of_a_motion_is_there_and_rest_is_two_rows(tmp_path: Path) -> None:
    record(tmp_path / "run.csv", ticks=100_000)
    time_s = read_trace(tmp_path / "run.csv").time_s
    steps = np.diff(time_s)
    assert np.all(steps > 0)
    assert np.median(steps) == pytest.approx(1 / TICK_HZ)
    assert len(time_s) < 4000
    assert time_s[-1] == 100.1


def test_the_file_has_its_name_only_when_it_is_complete(tmp_path: Path) -> None:
    path = tmp_path / "run.csv"
    trace = TraceWriter(path, TICK_HZ)
    assert not path.exists()
    trace.close()
    assert list(tmp_path.iterdir()) == [path]
    assert len(read_trace(path).time_s) == 0


def test_an_older_trace_stays_until_the_new_one_is_complete(tmp_path: Path) -> None:
    path = tmp_path / "run.csv"
    path.write_text("an older run")
    trace = TraceWriter(path, TICK_HZ)
    assert path.read_text() == "an older run"
    trace.close()
    assert path.read_text().startswith("time_s,")


def test_any_bytes_on_the_wire_survive(tmp_path: Path) -> None:
    path = tmp_path / "run.csv"
    everything = bytes(range(256)) + b'",\\r\\x00'
    table = Table(load_config())
    with TraceWriter(path, TICK_HZ) as trace:
        trace.record(table.status(), everything, everything[::-1])
    recorded = read_trace(path)
    assert recorded.received == [everything]
    assert recorded.transmitted == [everything[::-1]]


def test_a_name_with_another_ending_is_refused(tmp_path: Path) -> None:
    with pytest.raises(TraceError, match=r"\.csv or \.npz"):
        TraceWriter(tmp_path / "run.txt", TICK_HZ)


def test_a_file_that_is_no_trace_is_refused(tmp_path: Path) -> None:
    (tmp_path / "other.csv").write_text("a,b\n1,2\n")
    np.savez(tmp_path / "other.npz", a=np.zeros(3))
    for name in ("other.csv", "other.npz"):
        with pytest.raises(ValueError, match="is not a trace"):
            read_trace(tmp_path / name)


@pytest.mark.parametrize("name", ["run.csv", "run.npz"])
def test_a_trace_that_was_cut_or_changed_is_refused_by_its_name(name: str, tmp_path: Path) -> None:
    with TraceWriter(tmp_path / name, TICK_HZ) as trace:
        trace.record(Table(load_config()).status(), b"H\r", b"")
    whole, rng = (tmp_path / name).read_bytes(), np.random.default_rng(0)
    damaged = [whole[:-1], *(whole[: rng.integers(1, len(whole) - 1)] for _ in range(20))]
    index = whole.find(b"PK\x01\x02")  # where the archive's own list of its files begins
    damaged += [whole[: index + 8] + b"\x41" + whole[index + 9 :], whole.replace(b"0", b"\xff")]
    for content in damaged[:-1] if name.endswith("npz") else damaged[-1:]:
        (tmp_path / name).write_bytes(content)
        with pytest.raises(ValueError, match=f"{name}: is not a trace: "):
            read_trace(tmp_path / name)


@contextmanager
def largest_file(size: int) -> Iterator[None]:
    """Limit the size of all files of this process, as on a full disk."""
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    handler = signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, before[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)
        signal.signal(signal.SIGXFSZ, handler)


@pytest.mark.skipif(sys.platform == "win32", reason="no limit of file sizes")
@pytest.mark.parametrize("name", ["run.csv", "run.npz"])
@pytest.mark.parametrize("size", [0, 100, 20_000, 100_000])
def test_a_disk_that_is_full_leaves_what_was_written_until_then(tmp_path: Path, name: str, size: int) -> None:
    path = tmp_path / name
    path.write_text("an older run")
    with largest_file(size), pytest.raises(TraceError, match=r"run\.\w+\.part, as CSV"):
        record(path)
    assert sorted(file.name for file in tmp_path.iterdir()) == [name, f"{name}.part"]
    assert path.read_text() == "an older run"
    assert (tmp_path / f"{name}.part").stat().st_size == size


def test_a_disk_that_is_full_when_an_npz_is_packed_leaves_the_run_as_csv(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(file: IO[bytes], **_columns: object) -> None:
        file.write(b"PK")
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(np, "savez_compressed", full)
    with pytest.raises(TraceError, match="No space left on device; the rows written"):
        record(tmp_path / "run.npz")
    assert [file.name for file in tmp_path.iterdir()] == ["run.npz.part"]
    assert read_trace(tmp_path / "run.npz.part").time_s[-1] == 2.1


def test_a_run_that_fails_for_another_reason_leaves_no_torn_file_under_the_name(tmp_path: Path) -> None:
    def fail() -> None:
        with TraceWriter(tmp_path / "run.csv", TICK_HZ) as trace:
            trace.record(Table(load_config()).status(), b"", b"")
            raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        fail()
    assert [file.name for file in tmp_path.iterdir()] == ["run.csv.part"]
    assert len(read_trace(tmp_path / "run.csv.part").time_s) == 1


def test_a_trace_that_another_writes_is_left_to_it(tmp_path: Path) -> None:
    path = tmp_path / "run.csv"
    with TraceWriter(path, TICK_HZ) as first:
        with pytest.raises(TraceError, match="another emulator is writing it"):
            TraceWriter(path, TICK_HZ)
        first.record(Table(load_config()).status(), b"H", b"")
    assert read_trace(path).received == [b"H"]


@pytest.mark.parametrize("target", ["thesis.tex", "none"])
def test_a_symbolic_link_in_the_place_of_the_partial_file_is_not_followed(tmp_path: Path, target: str) -> None:
    (tmp_path / "thesis.tex").write_text("three years of work")
    (tmp_path / "run.csv.part").symlink_to(tmp_path / target)
    with pytest.raises(TraceError, match=r"run\.csv\.part exists"):
        TraceWriter(tmp_path / "run.csv", TICK_HZ)
    assert (tmp_path / "thesis.tex").read_text() == "three years of work"
    assert not (tmp_path / "none").exists()


def test_a_folder_cannot_become_a_trace(tmp_path: Path) -> None:
    (tmp_path / "run.csv").mkdir()
    with pytest.raises(TraceError, match="is a folder"):
        TraceWriter(tmp_path / "run.csv", TICK_HZ)
    assert [file.name for file in tmp_path.iterdir()] == ["run.csv"]


def test_an_npz_is_refused_at_the_start_where_numpy_is_missing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "numpy", None)
    with pytest.raises(TraceError, match=r"needs numpy; choose a \.csv file"):
        TraceWriter(tmp_path / "run.npz", TICK_HZ)
    TraceWriter(tmp_path / "run.csv", TICK_HZ).close()
