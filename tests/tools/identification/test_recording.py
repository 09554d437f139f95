from pathlib import Path

import numpy as np
import pytest

from tools.identification.errors import RecordingError
from tools.identification.recording import (
    DriveRecording,
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


@pytest.mark.parametrize(
    ("text", "complaint"),
    [
        ("", "has the columns \\(none\\)"),
        ("time_s,angle\n0,1\n", "has the columns time_s, angle; needed are"),
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
