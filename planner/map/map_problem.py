"""Everything that a configuration map depends on, derived from a scan."""

from dataclasses import dataclass

from planner.arrays import FloatArray
from planner.cell.cell import Cell
from planner.cell.collision_model import CollisionModel, collision_model
from planner.cell.obstacles import cell_obstacles, workpiece_obstacle
from planner.cell.scan import Scan
from planner.kinematics.value import ValueFunction
from protocol.program.progress import Progress


@dataclass(frozen=True, eq=False)
class MapProblem:
    """A cell, a path through it, possible collisions, and the rating of poses.

    Attributes:
        name: name of the scan.
        cell: the arm, the table and the probe.
        T_WS: `(n_locations, 4, 4)`, the scan locations.
        collision: the collision model.
        pair_names: the name of each of its pairs.
        value: the value function.
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
        scan: the scan.
        progress: called with the number of finished points and of all points while the distance field of the workpiece
            is computed, once for each shape.
    """
    obstacles = (*cell_obstacles(scan.cell), workpiece_obstacle(scan, progress))
    model, pair_names = collision_model(scan.bodies, obstacles, scan.cell.T_BT, scan.cell.T_FS)
    return MapProblem(scan.name, scan.cell, scan.path.T_WS, model, pair_names, scan.value)
