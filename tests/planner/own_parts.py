"""Typical parts of users for `new-scan`, each with its options and its class."""

from typing import NamedTuple

import numpy as np
import trimesh

from tests.planner.parts import bracket, circle, plate, thin_walls


class OwnPart(NamedTuple):
    """A part: its mesh in the unit of its file, the options of `new-scan`, and its expected class."""

    mesh: trimesh.Trimesh
    name: str
    options: tuple[str, ...] = ()


def cylinder(radius: float, height: float) -> trimesh.Trimesh:
    mesh: trimesh.Trimesh = trimesh.creation.cylinder(radius=radius, height=height, sections=64)
    return mesh


def moved(mesh: trimesh.Trimesh, x: float, y: float, z: float) -> trimesh.Trimesh:
    mesh.apply_translation((x, y, z))
    return mesh


def lying(mesh: trimesh.Trimesh) -> trimesh.Trimesh:
    """The mesh with its z axis along y."""
    T = np.eye(4)
    T[:3, :3] = (1, 0, 0), (0, 0, 1), (0, -1, 0)
    mesh.apply_transform(T)
    return mesh


def gear(teeth: int, root_mm: float, tip_mm: float, height_mm: float) -> trimesh.Trimesh:
    turn = np.linspace(0.0, 2.0 * np.pi, 4 * teeth, endpoint=False)
    radius = np.where(np.arange(4 * teeth) % 4 < 2, tip_mm, root_mm)
    return plate(np.column_stack((radius * np.cos(turn), radius * np.sin(turn))), [], height_mm)


def holed_plate() -> trimesh.Trimesh:
    outline = np.array([[-100.0, -60.0], [100.0, -60.0], [100.0, 60.0], [-100.0, 60.0]])
    return plate(outline, [circle(0.0, 0.0, 25.0)], 8.0)


OWN_PARTS = {
    "cylinder": OwnPart(cylinder(60.0, 150.0), "turned part"),
    "box": OwnPart(trimesh.creation.box((120.0, 90.0, 100.0)), "box-like part"),
    "cone": OwnPart(trimesh.creation.cone(radius=70.0, height=150.0, sections=48), "turned part"),
    "torus": OwnPart(trimesh.creation.torus(80.0, 25.0), "flat turned part"),
    "gear": OwnPart(gear(12, 40.0, 46.0, 100.0), "turned part"),
    "bracket": OwnPart(bracket(), "free form"),
    "plate": OwnPart(holed_plate(), "plate"),
    "sphere": OwnPart(trimesh.creation.icosphere(subdivisions=3, radius=60.0), "sphere"),
    "tube": OwnPart(trimesh.creation.annulus(r_min=22.0, r_max=25.0, height=90.0, sections=64), "turned part"),
    "off center": OwnPart(moved(cylinder(50.0, 140.0), 4321.987, -300.0, 900.0), "turned part"),
    "in inches": OwnPart(cylinder(2.4, 6.0), "turned part", ("--unit", "inch")),
    "in meters": OwnPart(trimesh.creation.box((0.2, 0.15, 0.04)), "plate", ("--unit", "m")),
    "lying": OwnPart(lying(cylinder(40.0, 160.0)), "box-like part"),
    "set upright": OwnPart(lying(cylinder(40.0, 160.0)), "turned part", ("--up", "y")),
    "upside down": OwnPart(lying(lying(trimesh.creation.cone(70.0, 150.0))), "turned part", ("--up=-z",)),
    "open box": OwnPart(thin_walls(100), "mould"),
    "small": OwnPart(cylinder(8.0, 20.0), "flat turned part"),
}
