"""What a configuration map depends on, put together from a scan."""

from dataclasses import dataclass

from planner.arrays import FloatArray
from planner.cell.cell import Cell
from planner.cell.collision_model import CollisionModel, collision_model
from planner.cell.obstacles import cell_obstacles, workpiece_obstacle
from planner.cell.scan import Scan
from planner.kinematics.value import ValueFunction
from protocol.progress import Progress


@dataclass(frozen=True, eq=False)
class MapProblem:
    """A cell, a path through it, what can collide there, and how poses are rated.

    Attributes:
        name: What the scan is called.
        cell: The arm, the table and the probe.
        T_WS: `(n_locations, 4, 4)`, the scan locations.
        collision: What can collide.
        pair_names: The name of each of its pairs.
        value: The value function.
    """

    name: str
    cell: Cell
    T_WS: FloatArray
    collision: CollisionModel
    pair_names: tuple[str, ...]
    value: ValueFunction


def map_problem(scan: Scan, progress: Progress | None = None) -> MapProblem:
    """Return the map problem of a scan.

    Args:
        scan: The scan.
        progress: Called with the points done and all points while the workpiece's distance field is built, which
            happens once for each shape.
    """
    obstacles = (*cell_obstacles(scan.cell), workpiece_obstacle(scan, progress))
    model, pair_names = collision_model(scan.bodies, obstacles, scan.cell.T_BT, scan.cell.T_FS)
    return MapProblem(scan.name, scan.cell, scan.path.T_WS, model, pair_names, scan.value)
