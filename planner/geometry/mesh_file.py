"""Read the triangles of an STL, OBJ or PLY file: only the positions of the corners.

Names, comments, normals, colors, textures and materials are skipped, in any encoding.
"""

import io
import logging
import re
from pathlib import Path
from typing import NamedTuple

import numpy as np
from plyfile import PlyData, PlyElementParseError, PlyParseError

from planner.arrays import FloatArray, IndexArray
from planner.errors import WorkpieceError
from planner.geometry.polygons import triangulated

_log = logging.getLogger(__name__)

_STL_HEADER_BYTES = 84
_STL_TRIANGLE = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
_STL_VERTEX = re.compile(rb"^\s*vertex\b(.*)$", re.IGNORECASE | re.MULTILINE)
_STL_FACET = re.compile(rb"^\s*facet\b", re.IGNORECASE | re.MULTILINE)
_PLY_HEADER_END = b"end_header"
_PLY_COUNT = re.compile(rb"^\s*element\s+\S+\s+(\d+)", re.MULTILINE)
_PLY_CORNERS = ("vertex_indices", "vertex_index")
_ASCII = bytes(code if code < 128 else ord("?") for code in range(256))


class MeshFile(NamedTuple):
    """The content of a file.

    Attributes:
        vertices: `(n, 3)`, as written; may contain numbers that are not finite.
        faces: `(m, 3)`, indices of existing vertices.
        notes: ignored content, such as bytes after the last triangle.
    """

    vertices: FloatArray
    faces: IndexArray
    notes: tuple[str, ...] = ()


def read_mesh_file(file: Path) -> MeshFile:
    """Return the triangles of a file; the suffix of its name determines the format.

    Raises:
        WorkpieceError: the file is missing, empty, or not of the format of its suffix. The message names the file.
    """
    readers = {".stl": _read_stl, ".obj": _read_obj, ".ply": _read_ply}
    reader = readers.get(file.suffix.lower())
    if reader is None:
        raise WorkpieceError(f"{file}: a mesh file must end in .stl, .ply or .obj")
    try:
        content = file.read_bytes()
        _log.debug("read %s, %d bytes", file, len(content))
        return reader(content)
    except OSError as error:
        raise WorkpieceError(f"{file}: cannot be read ({error.strerror or error})") from error
    except WorkpieceError as error:
        raise WorkpieceError(f"{file}: {error}") from error


def _read_stl(content: bytes) -> MeshFile:
    if not content:
        raise WorkpieceError("the file is empty")
    # Some binary files begin with "solid" too, but a text contains no zero byte.
    if content.lstrip()[:5].lower() == b"solid" and b"\0" not in content[:1024]:
        return _read_text_stl(content)
    if len(content) < _STL_HEADER_BYTES:
        raise WorkpieceError("this is not an STL file: it has neither 'solid' at its start nor a binary header")
    count = int.from_bytes(content[80:84], "little")
    excess = len(content) - _STL_HEADER_BYTES - count * _STL_TRIANGLE.itemsize
    if excess < 0:
        raise WorkpieceError(
            f"the file ends too early: its header specifies {count} triangles, which need"
            f" {len(content) - excess} bytes, and it has {len(content)}; export it again"
        )
    triangles = np.frombuffer(content, _STL_TRIANGLE, count, _STL_HEADER_BYTES)["corners"]
    notes = (f"ignored {excess} bytes after the last triangle",) if excess else ()
    return MeshFile(triangles.reshape(-1, 3).astype(np.float64), np.arange(3 * count).reshape(-1, 3), notes)


def _read_text_stl(content: bytes) -> MeshFile:
    content = content.replace(b"\r\n", b"\n").replace(b"\r", b"\n")
    rows = [match.group(1).split() for match in _STL_VERTEX.finditer(content)]
    facets = len(_STL_FACET.findall(content))
    if len(rows) != 3 * facets:
        raise WorkpieceError(
            f"the file has {facets} facets and {len(rows)} vertices, three a facet are needed; it may be cut off"
        )
    try:
        vertices = np.array(rows, dtype=np.float64).reshape(-1, 3)
    except ValueError:
        line = next(at for at, row in enumerate(content.split(b"\n"), 1) if _is_bad_stl_vertex(row))
        raise WorkpieceError(f"line {line}: a vertex must be three numbers") from None
    return MeshFile(vertices, np.arange(len(vertices)).reshape(-1, 3))


def _is_bad_stl_vertex(line: bytes) -> bool:
    match = _STL_VERTEX.match(line)
    return match is not None and _numbers(match.group(1).split(), 3) is None


def _numbers(words: list[bytes], count: int) -> list[float] | None:
    """Return the first `count` words as numbers, or None if they are not numbers."""
    try:
        numbers = [float(word) for word in words[:count]]
    except ValueError:
        return None
    return numbers if len(numbers) == count else None


def _read_obj(content: bytes) -> MeshFile:
    vertices: list[list[float]] = []
    polygons: list[list[int]] = []
    lines_of_polygons: list[int] = []
    continued = b"\\\n"
    for number, line in enumerate(content.replace(b"\r\n", b"\n").replace(continued, b" ").split(b"\n"), 1):
        words = line.partition(b"#")[0].split()
        if not words:
            continue
        if words[0] == b"v":
            position = _numbers(words[1:], 3)
            if position is None:
                raise WorkpieceError(f"line {number}: a vertex must begin with three numbers")
            vertices.append(position)
        elif words[0] == b"f":
            polygons.append(_obj_corners(words[1:], len(vertices), number))
            lines_of_polygons.append(number)
    for number, polygon in zip(lines_of_polygons, polygons, strict=True):
        _check_corners(polygon, len(vertices), f"line {number}", first=1)
    positions = np.array(vertices, dtype=np.float64).reshape(-1, 3)
    return MeshFile(positions, triangulated(positions, polygons))


def _obj_corners(words: list[bytes], n_vertices: int, line: int) -> list[int]:
    """Return the vertices, from 0, of a face line; negative numbers count back from the last vertex so far."""
    try:
        numbers = [int(word.partition(b"/")[0]) for word in words]
    except ValueError:
        raise WorkpieceError(
            f"line {line}: a face must be whole numbers, such as 'f 1 2 3' or 'f 1/1 2/2 3/3'"
        ) from None
    if any(number < -n_vertices for number in numbers):
        raise WorkpieceError(
            f"line {line}: a face refers to vertex {min(numbers)}, counted back; there are {n_vertices} before it"
        )
    # OBJ counts from 1, so number 0 becomes -1 and is refused with those that are too large.
    return [number - 1 if number >= 0 else n_vertices + number for number in numbers]


def _check_corners(polygon: list[int], n_vertices: int, place: str, first: int) -> None:
    """Raise if a face has fewer than three corners, or one that is not a vertex; the file counts from `first`."""
    if len(polygon) < 3:
        raise WorkpieceError(f"{place}: a face has {len(polygon)} corners; three are needed")
    for corner in polygon:
        if not 0 <= corner < n_vertices:
            raise WorkpieceError(
                f"{place}: a face refers to vertex {corner + first}; there are {n_vertices}, counted from {first}"
            )


def _read_ply(content: bytes) -> MeshFile:
    if not content:
        raise WorkpieceError("the file is empty")
    content = _in_ascii(content)
    announced = sum(map(int, _PLY_COUNT.findall(content.partition(_PLY_HEADER_END)[0])))
    if announced > len(content):
        raise WorkpieceError(f"the file ends too early: its header specifies {announced} lines of data")
    try:
        elements = {element.name: element for element in PlyData.read(io.BytesIO(content)).elements}
    except PlyElementParseError as error:
        raise WorkpieceError(f"this PLY file ends too early or is damaged ({error})") from error
    except (PlyParseError, ValueError) as error:
        raise WorkpieceError(f"this is not a PLY file, or it is damaged ({error})") from error
    try:
        vertices = np.column_stack([elements["vertex"].data[axis] for axis in "xyz"]).astype(np.float64)
        faces = elements["face"].data
        key = next(name for name in _PLY_CORNERS if name in (faces.dtype.names or ()))
    except (KeyError, ValueError, StopIteration):
        raise WorkpieceError("this PLY file lacks vertices with x, y and z, or faces with vertex_indices") from None
    polygons = [corners.tolist() for corners in faces[key]]
    for number, polygon in enumerate(polygons):
        _check_corners(polygon, len(vertices), f"face {number}", first=0)
    return MeshFile(vertices, triangulated(vertices, polygons))


def _in_ascii(content: bytes) -> bytes:
    """Return a PLY file with question marks for non-ASCII text: comments may have any encoding."""
    header, mark, data = content.partition(_PLY_HEADER_END)
    header = header.translate(_ASCII)
    return header + mark + (data.translate(_ASCII) if b"format ascii" in header else data)
