from pathlib import Path

import pytest

from tools.command_line import check_folder, check_writable


def test_where_nothing_can_be_written_is_said_beforehand(tmp_path: Path) -> None:
    file = tmp_path / "file"
    file.write_text("", encoding="ascii")
    check_writable(tmp_path / "new.csv")
    check_writable(file)
    check_folder(tmp_path / "new" / "deep")
    for check, path in (
        (check_writable, tmp_path / "new" / "trace.csv"),
        (check_writable, tmp_path),
        (check_folder, file),
        (check_folder, file / "below"),
    ):
        with pytest.raises(OSError, match=r"is not a folder|is a folder"):
            check(path)
