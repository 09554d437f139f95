"""The workpiece: its class with approximate dimensions, and its mesh.

The predefined patterns of Fig. 2 need a class. It is given, or derived from a mesh. Frame W has its z axis up. A
workpiece of given dimensions stands on z = 0 with its middle on the axis. A mesh is placed as in its file.
"""

from dataclasses import dataclass

import numpy as np
import trimesh

from planner.errors import WorkpieceError


@dataclass(frozen=True)
class Sphere:
    """A sphere that stands on the plane of its base."""

    diameter_mm: float
    middle_mm: tuple[float, float, float] = (0.0, 0.0, 0.0)

    def mesh(self) -> trimesh.Trimesh:
        """Return the closed surface in frame W."""
        mesh: trimesh.Trimesh = trimesh.creation.icosphere(subdivisions=4, radius=0.5 * self.diameter_mm)
        mesh.apply_translation(np.add(self.middle_mm, (0.0, 0.0, 0.5 * self.diameter_mm)))
        return mesh

    @classmethod
    def measured(cls, mesh: trimesh.Trimesh) -> "Sphere":
        """Return the sphere that fits the mesh's vertices best, by linear least squares."""
        vertices = np.asarray(mesh.vertices)
        # |v|^2 = 2 v.c + (r^2 - |c|^2)
        A = np.column_stack((2.0 * vertices, np.ones(len(vertices))))
        solution = np.linalg.lstsq(A, np.sum(vertices**2, axis=1), rcond=None)[0]
        x, y, z = (float(value) for value in solution[:3])
        radius = float(np.sqrt(solution[3] + solution[:3] @ solution[:3]))
        return cls(2.0 * radius, (x, y, z - radius))


@dataclass(frozen=True)
class Cylinder:
    """An upright cylinder."""

    diameter_mm: float
    height_mm: float
    middle_mm: tuple[float, float, float] = (0.0, 0.0, 0.0)

    def mesh(self) -> trimesh.Trimesh:
        """Return the closed surface in frame W."""
        mesh: trimesh.Trimesh = trimesh.creation.cylinder(
            radius=0.5 * self.diameter_mm, height=self.height_mm, sections=96
        )
        mesh.apply_translation(np.add(self.middle_mm, (0.0, 0.0, 0.5 * self.height_mm)))
        return mesh

    @classmethod
    def measured(cls, mesh: trimesh.Trimesh) -> "Cylinder":
        """Return the upright cylinder with the height of the mesh's bounding box and the diameter of its wider side."""
        (width, depth, height), middle = _box(mesh)
        return cls(max(width, depth), height, middle)


@dataclass(frozen=True)
class Mould:
    """A block with a rectangular cavity, open at the top; length along x, width along y."""

    length_mm: float
    width_mm: float
    height_mm: float
    cavity_length_mm: float
    cavity_width_mm: float
    cavity_depth_mm: float
    middle_mm: tuple[float, float, float] = (0.0, 0.0, 0.0)

    def __post_init__(self) -> None:
        for name in ("length", "width"):
            outer, inner = getattr(self, f"{name}_mm"), getattr(self, f"cavity_{name}_mm")
            if not inner < outer:
                raise WorkpieceError(f"the mould's cavity_{name}_mm is {inner:g}; it must be below {name}_mm {outer:g}")
        if not self.cavity_depth_mm < self.height_mm:
            raise WorkpieceError(
                f"the mould's cavity_depth_mm is {self.cavity_depth_mm:g};"
                f" it must be below height_mm {self.height_mm:g}"
            )

    def mesh(self) -> trimesh.Trimesh:
        """Return the closed surface in frame W."""
        floor = self.height_mm - self.cavity_depth_mm
        rings = [
            (self.length_mm, self.width_mm, 0.0),
            (self.length_mm, self.width_mm, self.height_mm),
            (self.cavity_length_mm, self.cavity_width_mm, self.height_mm),
            (self.cavity_length_mm, self.cavity_width_mm, floor),
        ]
        corners = [(-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5)]
        vertices = [(sx * length, sy * width, z) for length, width, z in rings for sx, sy in corners]
        # Each ring is connected to the next by four rectangles; bottom and cavity floor close the ends.
        quads = [
            (4 * ring + i, 4 * ring + (i + 1) % 4, 4 * ring + 4 + (i + 1) % 4, 4 * ring + 4 + i)
            for ring in range(3)
            for i in range(4)
        ]
        quads += [(3, 2, 1, 0), (12, 13, 14, 15)]
        faces = [triangle for a, b, c, d in quads for triangle in ((a, b, c), (a, c, d))]
        return trimesh.Trimesh(np.add(vertices, self.middle_mm), faces, process=False)

    @classmethod
    def measured(cls, mesh: trimesh.Trimesh) -> "Mould":
        """Return the mould with the mesh's bounding box; rays from above its middle measure the cavity.

        Raises:
            WorkpieceError: there is no cavity in the middle of the top.
        """
        (length, width, height), middle = _box(mesh)
        x, y, z = middle
        top = z + height
        floor = _first_hit(mesh, (x, y, top + 1.0), (0.0, 0.0, -1.0))
        depth = floor - 1.0
        if not 0.0 < depth < height:
            raise WorkpieceError("the mesh has no cavity in the middle of its top, as a mould must")
        half = (x, y, top - 0.5 * depth)
        left, right, front, back = (
            _first_hit(mesh, half, direction) for direction in ((-1, 0, 0), (1, 0, 0), (0, -1, 0), (0, 1, 0))
        )
        return cls(length, width, height, left + right, front + back, depth, middle)


@dataclass(frozen=True)
class Block:
    """A block that is scanned from above; length along x, width along y."""

    length_mm: float
    width_mm: float
    height_mm: float
    middle_mm: tuple[float, float, float] = (0.0, 0.0, 0.0)

    def mesh(self) -> trimesh.Trimesh:
        """Return the closed surface in frame W."""
        mesh: trimesh.Trimesh = trimesh.creation.box((self.length_mm, self.width_mm, self.height_mm))
        mesh.apply_translation(np.add(self.middle_mm, (0.0, 0.0, 0.5 * self.height_mm)))
        return mesh

    @classmethod
    def measured(cls, mesh: trimesh.Trimesh) -> "Block":
        """Return the mesh's bounding box."""
        (length, width, height), middle = _box(mesh)
        return cls(length, width, height, middle)


Workpiece = Sphere | Cylinder | Mould | Block

CLASSES: dict[str, type[Workpiece]] = {"block": Block, "cylinder": Cylinder, "mould": Mould, "sphere": Sphere}


def _box(mesh: trimesh.Trimesh) -> tuple[tuple[float, float, float], tuple[float, float, float]]:
    """Return the sides of the mesh's box, and the middle of its base."""
    lower, upper = np.asarray(mesh.bounds)
    dx, dy, dz = (float(side) for side in upper - lower)
    return (dx, dy, dz), (float(lower[0]) + 0.5 * dx, float(lower[1]) + 0.5 * dy, float(lower[2]))


def _first_hit(mesh: trimesh.Trimesh, origin: tuple[float, ...], direction: tuple[float, ...]) -> float:
    """Return the distance along a ray to the mesh, infinity if it misses."""
    hits, _, _ = mesh.ray.intersects_location([origin], [direction])
    return float(np.linalg.norm(hits - origin, axis=1).min()) if len(hits) else np.inf
