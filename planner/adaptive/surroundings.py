"""What planning a strip needs: the cell and its limits, and what counts as solid. No mesh is part of it."""

from dataclasses import dataclass

from planner.arrays import FloatArray
from planner.cell.bodies import Bodies
from planner.cell.cell import Cell
from planner.cell.collision_model import CollisionModel, collision_model
from planner.cell.obstacles import Obstacle, cell_obstacles
from planner.cell.scan import Scan
from planner.kinematics.value import ValueFunction
from planner.map.map_problem import MapProblem
from planner.table.cost import Weights
from planner.table.motion import Limits


@dataclass(frozen=True, eq=False)
class Surroundings:
    """The cell of a session.

    Attributes:
        name: What the session is called.
        cell: Arm, table and probe.
        bodies: What moves with the arm and must not collide.
        value: What makes a pose good.
        limits: The table's limits.
        weights: Weights of the table's motion.
    """

    name: str
    cell: Cell
    bodies: Bodies
    value: ValueFunction
    limits: Limits
    weights: Weights

    @classmethod
    def of(cls, scan: Scan) -> "Surroundings":
        """Return the cell of a scan, without its workpiece."""
        return cls(scan.name, scan.cell, scan.bodies, scan.value, scan.limits, scan.weights)

    def collision(self, solid: Obstacle) -> tuple[CollisionModel, tuple[str, ...]]:
        """Return what can collide, with something solid on the table, and the name of each pair."""
        obstacles = (*cell_obstacles(self.cell), solid)
        return collision_model(self.bodies, obstacles, self.cell.T_BT, self.cell.T_FS)

    def map_problem(self, T_WS: FloatArray, solid: Obstacle) -> MapProblem:
        """Return the map problem of probe poses `(n, 4, 4)` past something solid on the table."""
        model, pair_names = self.collision(solid)
        return MapProblem(self.name, self.cell, T_WS, model, pair_names, self.value)
