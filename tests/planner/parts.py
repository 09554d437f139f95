"""Workpieces of the tests, each with a difficulty of meshes: thin walls, cavities, bodies, a knot."""

import mapbox_earcut
import numpy as np
import trimesh

from planner.arrays import FloatArray, IndexArray


def tube(center: FloatArray, radius_mm: float, sides: int) -> trimesh.Trimesh:
    """A round tube around a closed curve `(n, 3)`."""
    ahead = np.roll(center, -1, axis=0) - np.roll(center, 1, axis=0)
    ahead /= np.linalg.norm(ahead, axis=1, keepdims=True)
    across = np.cross(ahead, (0.0, 0.0, 1.0))
    across /= np.linalg.norm(across, axis=1, keepdims=True)
    up = np.cross(across, ahead)
    turn = np.linspace(0.0, 2.0 * np.pi, sides, endpoint=False)[:, np.newaxis, np.newaxis]
    rings = center + radius_mm * (np.cos(turn) * across + np.sin(turn) * up)
    n = len(center)
    i, j = (index.ravel() for index in np.meshgrid(np.arange(sides), np.arange(n), indexing="ij"))
    a, b = i * n + j, i * n + (j + 1) % n
    c, d = (i + 1) % sides * n + (j + 1) % n, (i + 1) % sides * n + j
    faces = np.concatenate((np.column_stack((a, b, c)), np.column_stack((a, c, d))))
    return upright(trimesh.Trimesh(rings.reshape(-1, 3), faces, process=False))


def torus_knot(steps: int, sides: int) -> trimesh.Trimesh:
    """The trefoil on a torus: 140 mm wide."""
    t = np.linspace(0.0, 2.0 * np.pi, steps, endpoint=False)
    away = 40.0 + 18.0 * np.cos(3.0 * t)
    curve = np.column_stack((away * np.cos(2.0 * t), away * np.sin(2.0 * t), 24.0 * np.sin(3.0 * t)))
    return tube(curve, 10.0, sides)


def plate(outline: FloatArray, holes: list[FloatArray], thickness_mm: float) -> trimesh.Trimesh:
    """A flat plate with holes through it, on z = 0."""
    rings = [outline, *(hole[::-1] for hole in holes)]
    corners = np.concatenate(rings)
    ends = np.cumsum([len(ring) for ring in rings])
    lid: IndexArray = mapbox_earcut.triangulate_float64(corners, ends.astype(np.uint32)).reshape(-1, 3).astype(np.int64)
    (ax, ay), (bx, by), (cx, cy) = corners[lid[0]]
    if (bx - ax) * (cy - ay) < (cx - ax) * (by - ay):
        lid = lid[:, ::-1]
    n = len(corners)
    walls = []
    for first, end in zip([0, *ends[:-1]], ends, strict=True):
        ring = np.arange(first, end)
        after = np.roll(ring, -1)
        walls += [np.column_stack((ring, after, after + n)), np.column_stack((ring, after + n, ring + n))]
    vertices = np.vstack(
        (np.column_stack((corners, np.zeros(n))), np.column_stack((corners, np.full(n, thickness_mm))))
    )
    faces = np.concatenate((lid[:, ::-1], lid + n, *walls))
    return trimesh.Trimesh(vertices, faces, process=False)


def circle(x_mm: float, y_mm: float, radius_mm: float, count: int = 48) -> FloatArray:
    turn = np.linspace(0.0, 2.0 * np.pi, count, endpoint=False)
    return np.column_stack((x_mm + radius_mm * np.cos(turn), y_mm + radius_mm * np.sin(turn)))


def bracket() -> trimesh.Trimesh:
    """A base with two holes, and an upright plate with two more on it: two bodies that touch."""
    base = plate(
        np.array([[-60, -40], [60, -40], [60, 40], [-60, 40.0]]), [circle(-35, -15, 9), circle(35, -15, 9)], 12.0
    )
    wall = plate(
        np.array([[-50, 0], [50, 0], [50, 70], [0, 95], [-50, 70.0]]), [circle(-22, 40, 12), circle(22, 40, 12)], 10.0
    )
    wall.vertices = np.asarray(wall.vertices)[:, [0, 2, 1]] * (1.0, -1.0, 1.0) + (0.0, 30.0, 12.0)
    return joined(base, wall)


def joined(*bodies: trimesh.Trimesh) -> trimesh.Trimesh:
    mesh = trimesh.util.concatenate(bodies)
    assert isinstance(mesh, trimesh.Trimesh)
    return mesh


def upright(mesh: trimesh.Trimesh) -> trimesh.Trimesh:
    """The mesh moved to z = 0 with its middle on the axis."""
    lower, upper = np.asarray(mesh.bounds)
    mesh.apply_translation((-(lower[0] + upper[0]) / 2, -(lower[1] + upper[1]) / 2, -lower[2]))
    return mesh


def refined(mesh: trimesh.Trimesh, triangles: int) -> trimesh.Trimesh:
    """The same surface with at least the given number of triangles."""
    while len(mesh.faces) < triangles:
        mesh = mesh.subdivide()
    return mesh


def thin_walls(triangles: int) -> trimesh.Trimesh:
    """An open box of 120 mm with walls of 2 mm."""
    floor = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]])
    corners = [
        np.column_stack((half * floor, np.full(4, z)))
        for half, z in ((60.0, 0.0), (60.0, 80.0), (58.0, 80.0), (58.0, 2.0))
    ]
    quads = [(3, 2, 1, 0), (12, 13, 14, 15)]
    for ring in range(3):
        for i in range(4):
            j = (i + 1) % 4
            quads.append((4 * ring + i, 4 * ring + j, 4 * ring + 4 + j, 4 * ring + 4 + i))
    faces = [triangle for a, b, c, d in quads for triangle in ((a, b, c), (a, c, d))]
    return refined(trimesh.Trimesh(np.concatenate(corners), np.array(faces), process=False), triangles)


def hollow_ball(triangles: int) -> trimesh.Trimesh:
    """A ball of 120 mm with a cavity, written inside out, and a ball in it."""
    shells = [trimesh.creation.icosphere(subdivisions=3, radius=radius) for radius in (60.0, 45.0, 20.0)]
    shells[0].invert()
    shells[2].invert()
    return upright(refined(joined(*shells), triangles))


def two_bodies(triangles: int) -> trimesh.Trimesh:
    """A post and a block beside each other, the block inside out."""
    post = trimesh.creation.cylinder(radius=25.0, height=110.0, sections=64)
    post.apply_translation((-45.0, 0.0, 55.0))
    block = trimesh.creation.box((60.0, 80.0, 50.0))
    block.apply_translation((40.0, 10.0, 25.0))
    block.invert()
    return refined(joined(post, block), triangles)


def perforated(triangles: int) -> trimesh.Trimesh:
    return refined(bracket(), triangles)


def knot(triangles: int) -> trimesh.Trimesh:
    return torus_knot(triangles // 50, 25)


def impeller(blades: int = 7) -> trimesh.Trimesh:
    """A disc with a hub and leaning blades, which stand on it: what lies under a blade is seen from beside it."""
    outline = np.array([[0, 0], [60, 0], [60, 8], [18, 8], [18, 55], [0, 55.0]])
    return joined(
        trimesh.creation.revolve(outline, sections=72), *(_blade(2.0 * np.pi * k / blades) for k in range(blades))
    )


def _blade(azimuth: float, thickness_mm: float = 3.0, count: int = 9) -> trimesh.Trimesh:
    """A blade from beside the hub outwards that leans over by 40 deg about the axis from bottom to top."""
    away, up = np.meshgrid(np.linspace(20.0, 56.0, count), np.linspace(8.0, 45.0, count), indexing="ij")
    turn = azimuth + np.radians(40.0) * (up - 8.0) / 37.0
    across = np.stack((-np.sin(turn), np.cos(turn), np.zeros_like(turn)), axis=-1)
    middle = np.stack((away * np.cos(turn), away * np.sin(turn), up), axis=-1)
    sides = np.stack((middle - 0.5 * thickness_mm * across, middle + 0.5 * thickness_mm * across))
    number = np.arange(sides[..., 0].size).reshape(sides.shape[:3])
    quads = [_quads(number[0].T), _quads(number[1])]
    quads += [_quads(number[:, 0].T), _quads(number[:, -1])]
    quads += [_quads(number[:, :, 0]), _quads(number[:, :, -1].T)]
    faces = np.concatenate([np.concatenate((quad[:, [0, 1, 2]], quad[:, [0, 2, 3]])) for quad in quads])
    blade = trimesh.Trimesh(sides.reshape(-1, 3), faces, process=True)
    trimesh.repair.fix_normals(blade)  # type: ignore[no-untyped-call] # trimesh has no types here
    return blade


def _quads(grid: IndexArray) -> IndexArray:
    """The corners of the cells of a grid of vertices, around each cell."""
    return np.stack((grid[:-1, :-1], grid[1:, :-1], grid[1:, 1:], grid[:-1, 1:]), axis=-1).reshape(-1, 4)
