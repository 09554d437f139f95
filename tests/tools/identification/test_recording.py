from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose

from tools.identification.errors import RecordingError
from tools.identification.recording import (
    DriveRecording,
    Sent,
    WireRecording,
    read_recording,
    write_recording,
)


def test_a_recording_comes_back_from_its_file(recording: WireRecording, tmp_path: Path) -> None:
    path = tmp_path / "trace.csv"

    write_recording(path, recording)
    read = read_recording(path)

    assert isinstance(read, WireRecording)
    assert [sent[1:3] for sent in read.commands] == [sent[1:3] for sent in recording.commands]
    np.testing.assert_allclose(read.time_s, recording.time_s, atol=1e-6)
    assert read.position_deg.tolist() == recording.position_deg.tolist()
    np.testing.assert_allclose(read.reply_s, recording.reply_s, atol=1e-6)
    assert read.resolution_deg == 0.1


@pytest.mark.parametrize("begin_s", [-7.25, 5000.0, 1_700_000_000.0])
def test_the_clock_may_count_from_anywhere(begin_s: float, recording: WireRecording, tmp_path: Path) -> None:
    path = tmp_path / "trace.csv"
    write_recording(
        path,
        recording._replace(
            commands=tuple(
                sent._replace(time_s=sent.time_s + begin_s, reply_s=sent.reply_s + begin_s)
                for sent in recording.commands
            ),
            time_s=recording.time_s + begin_s,
            reply_s=recording.reply_s + begin_s,
        ),
    )

    again = read_recording(path)

    assert isinstance(again, WireRecording)
    assert 0.0 <= again.commands[0].time_s < 1.0
    assert_allclose(again.time_s - again.time_s[0], recording.time_s - recording.time_s[0], atol=2e-6)
    assert_allclose(again.reply_s - again.time_s, recording.reply_s - recording.time_s, atol=2e-6)


def test_a_recording_need_not_say_when_the_replies_came(tmp_path: Path) -> None:
    path = tmp_path / "trace.csv"
    path.write_text("time_s,command,position_deg\n0.0,P 10.0,\n0.1,H,0.0\n", encoding="ascii")

    read = read_recording(path)

    assert isinstance(read, WireRecording)
    assert np.isnan(read.commands[0].reply_s)
    assert np.isnan(read.reply_s).tolist() == [True]


def test_a_drives_file_is_known_by_its_columns(tmp_path: Path) -> None:
    path = tmp_path / "drive.csv"
    path.write_text("time_s,current_A,duty,encoder_deg\n0,0,0.1,0\n0.001,0,0.2,0.5\n", encoding="ascii")

    read = read_recording(path)

    assert isinstance(read, DriveRecording)
    assert read.duty.tolist() == [0.1, 0.2]
    assert read.position_deg.tolist() == [0.0, 0.5]


PLAIN = """time_s,command,position_deg,reply_s
0.5,P 10.5,,0.51
0.625,H,0.1,0.635
0.75,H,-2.5,0.76
"""


def with_decimal_commas(text: str) -> str:
    return text.replace(",", ";").replace(".", ",")


@pytest.mark.parametrize(
    ("text", "encoding"),
    [
        (PLAIN, "utf-8-sig"),
        (PLAIN.replace(",", ";"), "utf-8"),
        (PLAIN.replace(",", "\t"), "utf-8"),
        (with_decimal_commas(PLAIN), "utf-8-sig"),
        (with_decimal_commas(PLAIN).replace("\n", "\r\n"), "utf-8"),
        ("sep=;\n" + with_decimal_commas(PLAIN), "utf-8"),
        (PLAIN.upper(), "utf-8"),
        (PLAIN.lower(), "utf-8"),
        (PLAIN.replace(",", " , "), "utf-8"),
        (PLAIN.replace("\n", "\n\n"), "utf-8"),
        ("".join(f"{line},,\n" for line in PLAIN.splitlines()), "utf-8"),
        (
            PLAIN.replace("0.625,H,0.1,0.635", '"0,625",H,"0,1","0,635"')
            .replace(".", ",")
            .replace("0,5,P 10,5,,0,51", '"0,5","P 10,5",,"0,51"')
            .replace("0,75,H,-2,5,0,76", '"0,75",H,"-2,5","0,76"'),
            "utf-8",
        ),
    ],
)
def test_a_file_that_a_spreadsheet_wrote_is_the_same_recording(text: str, encoding: str, tmp_path: Path) -> None:
    path = tmp_path / "trace.csv"
    path.write_bytes(text.encode(encoding))

    read = read_recording(path)

    assert isinstance(read, WireRecording)
    assert read.commands == (Sent(0.5, "P", 10.5, 0.51),)
    assert read.time_s.tolist() == [0.625, 0.75]
    assert read.position_deg.tolist() == [0.1, -2.5]
    assert read.reply_s.tolist() == [0.635, 0.76]


def test_a_row_that_is_there_twice_counts_once(tmp_path: Path) -> None:
    path = tmp_path / "trace.csv"
    path.write_text(PLAIN + PLAIN.partition("\n")[2], encoding="ascii")

    read = read_recording(path)

    assert isinstance(read, WireRecording)
    assert len(read.commands) == 1
    assert read.time_s.tolist() == [0.625, 0.75]


@pytest.mark.parametrize(
    ("data", "complaint"),
    [
        (PLAIN.encode("utf-16"), "is UTF-16 text; save it as CSV in UTF-8"),
        (PLAIN.replace("H", "Ä").encode("latin-1"), "line 3 holds byte 0xC4, which is not UTF-8"),
        (
            PLAIN.replace("0.625,", "0,625,").encode(),
            "line 3 has 5 cells, but there are 4 columns; with a decimal comma",
        ),
        (
            PLAIN.replace(",", ";").replace("0.76", "0,76").encode(),
            "line 2 has a decimal point, line 4 a decimal comma",
        ),
        (PLAIN.replace("-2.5", '"1.234,5"').encode(), "line [24] .*(thousands separators|a decimal comma)"),
        (PLAIN.replace("reply_s", "Time_s").encode(), "two columns time_s"),
        (PLAIN.replace("P 10.5", "10.5").encode(), "line 2: the command is '10.5'"),
        (
            PLAIN.replace("0.625", "0.775").encode(),
            "line 4: time_s goes back from 0.775 to 0.75 s, the first of 1 such",
        ),
    ],
)
def test_a_file_that_is_not_understood_is_refused_by_its_own_name(data: bytes, complaint: str, tmp_path: Path) -> None:
    path = tmp_path / "trace.csv"
    path.write_bytes(data)

    with pytest.raises(RecordingError, match=complaint):
        read_recording(path)


@pytest.mark.parametrize(
    ("text", "complaint"),
    [
        ("", "has the columns \\(none\\)"),
        ("time_s,angle\n0,1\n", "has the columns time_s, angle; required are"),
        ("time_s,command,position_deg\n0,H,twelve\n", "line 2: position_deg is 'twelve'; it must be a number"),
        ("time_s,command,position_deg\n0,X,1\n", "line 2: the command is 'X'"),
        ("time_s,command,position_deg\n0,P,\n", "line 2: command is ''; it must be a number"),
        ("time_s,duty,position_deg\n0,nan,1\n", "line 2: duty is 'nan'"),
    ],
)
def test_a_file_that_cannot_be_read_is_refused_with_its_line(text: str, complaint: str, tmp_path: Path) -> None:
    path = tmp_path / "bad.csv"
    path.write_text(text, encoding="ascii")

    with pytest.raises(RecordingError, match=complaint):
        read_recording(path)
