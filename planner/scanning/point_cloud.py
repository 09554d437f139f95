"""Point clouds on disk, written continuously: PLY (binary) and XYZ (text). A file appears when it is closed."""

from collections.abc import Sequence
from contextlib import ExitStack
from pathlib import Path
from types import TracebackType
from typing import Self

import numpy as np
from plyfile import PlyData

from planner.arrays import FloatArray, IndexArray
from protocol.files.whole_file import whole_file

# A vertex in the file. Single precision has an error of 0.03 micrometers at 500 mm.
_COORDINATES = ("x", "y", "z", "beam_x", "beam_y", "beam_z")
_VERTEX = np.dtype([*((name, "<f4") for name in _COORDINATES), ("profile", "<u4")])
_WITH_NORMAL = ("x", "y", "z", "nx", "ny", "nz")


class PlyWriter:
    """A binary PLY file of points (mm), each with the direction of the laser beam and the number of its profile.

    Used as a context manager. The data written so far are kept: after an exception, too, the file is closed properly
    and appears.
    """

    def __init__(self, file: Path, comment: str = "") -> None:
        """Create the file.

        Args:
            file: its final path.
            comment: a line for its header.
        """
        self.count = 0
        self._comment = comment.replace("\n", " ")
        self._stack = ExitStack()
        self._file = self._stack.enter_context(whole_file(file)).open("wb")
        self._file.write(self._header())

    def write(self, points: FloatArray, beams: FloatArray, profiles: IndexArray) -> None:
        """Append points `(m, 3)`, unit vectors `(m, 3)` and numbers `(m,)`."""
        vertices = np.empty(len(points), dtype=_VERTEX)
        columns = np.column_stack((points, beams))
        for name, column in zip(_COORDINATES, columns.T, strict=True):
            vertices[name] = column
        vertices["profile"] = profiles
        self._file.write(vertices.tobytes())
        self.count += len(points)

    def _header(self) -> bytes:
        """Return the header, whose length does not depend on the number of points."""
        comments = (
            self._comment,
            "x y z in mm in the workpiece's frame; beam: direction of the laser; profile: its number",
            "." * (20 - len(str(self.count))),
        )
        return _header(comments, self.count, (*(f"float {name}" for name in _COORDINATES), "uint profile"))

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        self._file.seek(0)
        self._file.write(self._header())
        self._file.close()
        self._stack.close()


def read_cloud(file: Path) -> tuple[FloatArray, FloatArray]:
    """Return the points `(n, 3)` in mm and the directions of the laser `(n, 3)` of a file that `PlyWriter` wrote."""
    with file.open("rb") as content:
        vertices = PlyData.read(content, mmap=False)["vertex"].data
    columns = np.column_stack([np.asarray(vertices[name], dtype=np.float64) for name in _COORDINATES])
    return columns[:, :3], columns[:, 3:]


def write_normals(file: Path, points: FloatArray, normals: FloatArray, comment: str = "") -> None:
    """Write points `(n, 3)` in mm with their normals `(n, 3)` to a binary PLY file, for reconstruction programs."""
    comments = (comment.replace("\n", " "), "x y z in mm in the workpiece's frame; nx ny nz: outward normal")
    with whole_file(file) as partial:
        header = _header(comments, len(points), tuple(f"float {name}" for name in _WITH_NORMAL))
        partial.write_bytes(header + np.column_stack((points, normals)).astype("<f4").tobytes())


def _header(comments: Sequence[str], count: int, properties: Sequence[str]) -> bytes:
    lines = [
        "ply",
        "format binary_little_endian 1.0",
        *(f"comment {comment}" for comment in comments),
        f"element vertex {count}",
        *(f"property {each}" for each in properties),
        "end_header",
    ]
    return ("\n".join(lines) + "\n").encode("ascii", "replace")


class XyzWriter:
    """A text file with one line per point: x y z in mm, to a tenth of a micrometer. Used like `PlyWriter`."""

    def __init__(self, file: Path) -> None:
        """Create the file."""
        self._stack = ExitStack()
        self._file = self._stack.enter_context(whole_file(file)).open("w", encoding="ascii")

    def write(self, points: FloatArray) -> None:
        """Append points `(m, 3)`."""
        self._file.write(("%.4f %.4f %.4f\n" * len(points)) % tuple(points.ravel()))

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        self._file.close()
        self._stack.close()
