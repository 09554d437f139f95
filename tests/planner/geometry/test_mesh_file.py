import struct
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import trimesh

from planner.errors import WorkpieceError
from planner.geometry.mesh_file import MeshFile, read_mesh_file

BLOCK = trimesh.creation.box((60.0, 40.0, 20.0))
CORNERS = np.asarray(BLOCK.vertices)
FACES = np.asarray(BLOCK.faces)


def binary_stl(count: int = 12, header: bytes = b"") -> bytes:
    rows = b"".join(struct.pack("<12fH", 0, 0, 0, *CORNERS[face].ravel(), 0) for face in FACES)
    return header.ljust(80, b"\0") + struct.pack("<I", count) + rows


def text_stl(name: bytes = b"block", end: bytes = b"\n") -> bytes:
    lines = [b"solid " + name]
    for face in FACES:
        lines += [b"facet normal 0 0 0", b"  outer loop"]
        lines += [b"    vertex %r %r %r" % tuple(float(x) for x in CORNERS[corner]) for corner in face]
        lines += [b"  endloop", b"endfacet"]
    return end.join([*lines, b"endsolid " + name, b""])


def obj(corner: str = "{}", vertex: str = "v {} {} {}", head: str = "", end: str = "\n", first: int = 1) -> bytes:
    """A block whose face lines name each corner by `corner`, numbered from `first`."""
    lines = [
        head,
        *(vertex.format(*map(float, v)) for v in CORNERS),
        *(["vt 0 0", "vn 0 0 1"] if "/" in corner else []),
    ]
    lines += ["f " + " ".join(corner.format(int(index) + first) for index in face) for face in FACES]
    return end.join(lines).encode("latin-1")


def faces_first(content: bytes) -> bytes:
    lines = content.splitlines()
    return b"\n".join([line for line in lines if line[:1] == b"f"] + [line for line in lines if line[:1] != b"f"])


def ply(form: str = "ascii", comment: bytes = b"", end: bytes = b"\n") -> bytes:
    order = ">" if "big" in form else "<"
    head = [b"ply", b"format " + form.encode() + b" 1.0", b"comment " + comment, b"element vertex 8"]
    head += [b"property double " + axis for axis in (b"x", b"y", b"z")]
    head += [b"element face 12", b"property list uchar int vertex_indices", b"end_header", b""]
    if form == "ascii":
        rows = [b"%r %r %r" % tuple(map(float, v)) for v in CORNERS] + [b"3 %d %d %d" % tuple(face) for face in FACES]
        return end.join([*head[:-1], *rows, b""])
    data = b"".join(struct.pack(order + "3d", *v) for v in CORNERS)
    data += b"".join(struct.pack(order + "B3i", 3, *face) for face in FACES)
    return end.join(head) + data


def read(folder: Path, ending: str, content: bytes) -> MeshFile:
    file = folder / f"part.{ending}"
    file.write_bytes(content)
    return read_mesh_file(file)


SOUND: dict[str, tuple[str, Callable[[], bytes]]] = {
    "binary STL": ("stl", binary_stl),
    "binary STL that begins with solid": ("stl", lambda: binary_stl(header=b"solid part, binary all the same")),
    "binary STL with a latin-1 header": ("STL", lambda: binary_stl(header=b"Geh\xe4use")),
    "text STL": ("stl", text_stl),
    "text STL with a latin-1 name": ("stl", lambda: text_stl(b"Geh\xe4use Gr\xf6\xdfe 3")),
    "text STL with a name of keywords": ("stl", lambda: text_stl(b"vertex facet")),
    "text STL with CR LF": ("stl", lambda: text_stl(end=b"\r\n")),
    "text STL in capitals": ("stl", lambda: text_stl().upper()),
    "text STL with tabs": ("stl", lambda: text_stl().replace(b" ", b"\t")),
    "text STL after a blank line": ("stl", lambda: b"\n \n" + text_stl()),
    "OBJ": ("obj", obj),
    "OBJ with texture": ("obj", lambda: obj("{}/1")),
    "OBJ with normals": ("obj", lambda: obj("{}//1")),
    "OBJ with both and materials": ("obj", lambda: obj("{}/1/1", head="mtllib none.mtl\nusemtl steel\no block")),
    "OBJ with colors": ("obj", lambda: obj(vertex="v {} {} {} 0.5 0.5 0.5")),
    "OBJ with tabs": ("obj", lambda: obj(vertex="v\t{}\t{}\t{}").replace(b"f ", b"f\t")),
    "OBJ with comments": ("obj", lambda: obj("{} ", vertex="v {} {} {} # mm").replace(b" \n", b" # side\n")),
    "OBJ with a latin-1 comment": ("obj", lambda: obj(head="# Größe")),
    "OBJ with CR LF": ("obj", lambda: obj(end="\r\n")),
    "OBJ with exponents": ("obj", lambda: obj(vertex="v {:e} {:e} {:+.9e}")),
    "OBJ that counts back": ("obj", lambda: obj(first=-8)),
    "OBJ with lines that go on": ("obj", lambda: obj("{} \\\n")),
    "OBJ in which faces come first": (
        "obj",
        lambda: faces_first(obj()),
    ),
    "OBJ with points and lines": ("obj", lambda: obj(head="p 1\nl 1 2\ncstype bezier\ns off\ng side")),
    "text PLY": ("ply", ply),
    "text PLY with a latin-1 comment": ("ply", lambda: ply(comment=b"Gr\xf6\xdfe")),
    "text PLY with CR LF": ("ply", lambda: ply(end=b"\r\n")),
    "binary PLY": ("ply", lambda: ply("binary_little_endian", b"Gr\xf6\xdfe")),
    "binary PLY, big end first": ("ply", lambda: ply("binary_big_endian")),
}


@pytest.mark.parametrize("kind", SOUND)
def test_a_file_is_read_corner_by_corner(kind: str, tmp_path: Path) -> None:
    ending, content = SOUND[kind]
    found = read(tmp_path, ending, content())
    assert found.notes == ()
    np.testing.assert_allclose(found.vertices[found.faces], CORNERS[FACES], atol=1e-5)


@pytest.mark.parametrize("excess", [1, 50, 137])
def test_bytes_after_a_binary_stl_are_ignored_and_said(excess: int, tmp_path: Path) -> None:
    found = read(tmp_path, "stl", binary_stl() + b"x" * excess)
    np.testing.assert_allclose(found.vertices[found.faces], CORNERS[FACES])
    assert found.notes == (f"ignored {excess} bytes after the last triangle",)


QUADS = "f 1 2 3 4\nf 5 8 7 6\nf 1 5 6 2\nf 2 6 7 3\nf 3 7 8 4\nf 4 8 5 1\n"
RING = [(0, 0), (3, 0), (3, 3), (2, 3), (2, 1), (1, 1), (1, 3), (0, 3)]


def test_polygons_are_split_inside_their_outline(tmp_path: Path) -> None:
    """A prism over the letter U: its ends have eight corners and are far from convex."""
    n = len(RING)
    corners = [(10 * x, 10 * y, z) for z in (0, 20) for x, y in RING]
    sides = [(i, (i + 1) % n, n + (i + 1) % n, n + i) for i in range(n)]
    faces = [tuple(reversed(range(n))), tuple(range(n, 2 * n)), *sides]
    text = "".join("v {} {} {}\n".format(*corner) for corner in corners)
    text += "".join("f " + " ".join(str(corner + 1) for corner in face) + "\n" for face in faces)
    found = read(tmp_path, "obj", text.encode())
    mesh = trimesh.Trimesh(found.vertices, found.faces, process=False)
    assert mesh.is_watertight
    assert mesh.volume == pytest.approx(20 * 700.0)
    assert mesh.area == pytest.approx(2 * 700.0 + 20 * 160.0)


@pytest.mark.parametrize("turn", range(4))
def test_a_quad_with_a_notch_is_split_along_the_diagonal_inside(turn: int, tmp_path: Path) -> None:
    corners = np.roll([(0, 0, 0), (10, 0, 0), (2, 2, 0), (0, 10, 0)], turn, axis=0)
    text = "".join("v {} {} {}\n".format(*corner) for corner in corners) + "f 1 2 3 4\n"
    found = read(tmp_path, "obj", text.encode())
    assert trimesh.Trimesh(found.vertices, found.faces, process=False).area == pytest.approx(20.0)


WRONG: dict[str, tuple[str, bytes, str]] = {
    "an empty STL": ("stl", b"", "the file is empty"),
    "no STL": ("stl", b"hello", "not an STL file"),
    "a binary STL cut off": ("stl", binary_stl()[:-70], r"ends too early: its header specifies 12 triangles"),
    "a binary STL that announces too much": (
        "stl",
        binary_stl(2**31),
        "ends too early: its header specifies 2147483648",
    ),
    "a text STL cut off in a facet": ("stl", text_stl()[: text_stl().rindex(b"vertex")], "12 facets and 35 vertices"),
    "a text STL with a decimal comma": (
        "stl",
        text_stl().replace(b"-30.0 ", b"-30,0 ", 1),
        r"line 4: a vertex must be",
    ),
    "an OBJ vertex of two numbers": ("obj", b"v 1 2\n" + obj(), "line 1: a vertex must begin with three numbers"),
    "an OBJ vertex of words": ("obj", obj() + b"\nv a b c", r"line \d+: a vertex must begin with three numbers"),
    "an OBJ index too large": (
        "obj",
        obj() + b"\nf 1 2 9",
        r"line 22: a face refers to vertex 9; there are 8, counted from 1",
    ),
    "an OBJ index 0": ("obj", obj() + b"\nf 0 1 2", r"line 22: a face refers to vertex 0; there are 8, counted from 1"),
    "an OBJ index too far back": ("obj", obj() + b"\nf -1 -2 -9", r"line 22: .*vertex -9, counted back; there are 8"),
    "an OBJ index that is no number": ("obj", obj() + b"\nf a b c", "line 22: a face must be whole numbers"),
    "an OBJ face of two corners": ("obj", obj() + b"\nf 1 2", "line 22: a face has 2 corners; three are needed"),
    "an empty PLY": ("ply", b"", "the file is empty"),
    "no PLY": ("ply", b"hello\n", "not a PLY file"),
    "a PLY header cut off": ("ply", ply()[:60], "not a PLY file, or it is damaged"),
    "a text PLY cut off": ("ply", ply()[:-8], "ends too early or is damaged"),
    "a binary PLY cut off": ("ply", ply("binary_big_endian")[:-5], "ends too early or is damaged"),
    "a PLY that announces too much": (
        "ply",
        ply().replace(b"vertex 8", b"vertex 99999999999"),
        "specifies 100000000011 lines",
    ),
    "a PLY index too large": (
        "ply",
        ply().replace(b"\n3 1 3 0", b"\n3 1 3 8"),
        r"refers to vertex 8; there are 8, counted from 0",
    ),
    "a negative PLY index": ("ply", ply().replace(b"\n3 1 3 0", b"\n3 1 3 -1"), r"face 0: a face refers to vertex -1"),
    "a PLY of points": ("ply", ply().replace(b"element face", b"element fact"), "lacks"),
    "a PLY in an unknown format": ("ply", ply().replace(b"ascii", b"klingon"), "not a PLY file, or it is damaged"),
    "another kind of file": ("step", b"ISO-10303-21;", "must end in .stl, .ply or .obj"),
}


@pytest.mark.parametrize("kind", WRONG)
def test_what_is_wrong_with_a_file_is_said_in_one_line(kind: str, tmp_path: Path) -> None:
    ending, content, message = WRONG[kind]
    with pytest.raises(WorkpieceError, match=message) as refusal:
        read(tmp_path, ending, content)
    assert str(refusal.value).startswith(f"{tmp_path / f'part.{ending}'}: ")
    assert "\n" not in str(refusal.value)
    assert "module" not in str(refusal.value)


def test_a_file_that_is_not_there_is_refused(tmp_path: Path) -> None:
    with pytest.raises(WorkpieceError, match=r"absent.stl: cannot be read \(No such file"):
        read_mesh_file(tmp_path / "absent.stl")


def test_a_coordinate_that_is_no_number_is_kept_for_whoever_judges_the_mesh(tmp_path: Path) -> None:
    for ending, content in (("stl", text_stl()), ("obj", obj()), ("ply", ply())):
        found = read(tmp_path, ending, content.replace(b"-30.0", b"nan", 1))
        assert np.isnan(found.vertices).sum() == 1
