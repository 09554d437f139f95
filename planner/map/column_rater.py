"""Rate the columns of a configuration map one after another, as their scan locations become known.

What a cell's map depends on is laid out once; a new location then costs one pass over its table angles.
"""

from collections.abc import Mapping, Sequence
from dataclasses import asdict, replace

import numpy as np

from planner.arrays import CodeArray, FloatArray
from planner.kinematics.configuration import Configuration
from planner.map.map_builder import NO_POSES, digest_of, lay_out_cells, rate_columns, rate_with_user_factors
from planner.map.map_problem import MapProblem
from planner.map.map_reasons import reason_texts


class ColumnRater:
    """The columns of some arm configurations.

    Attributes:
        configurations: which ones, in the order of the results.
    """

    def __init__(self, problem: MapProblem, configurations: Sequence[Configuration], angle_count: int) -> None:
        """Lay out a map problem; its own locations do not count.

        Args:
            problem: the cell, what can collide in it, and the value function.
            configurations: which maps.
            angle_count: table angles over one turn.
        """
        self.configurations = tuple(configurations)
        self._problem = replace(problem, T_WS=problem.T_WS[:0])
        self._cells = lay_out_cells(self._problem, configurations, angle_count)
        self._angle_count = angle_count

    def goals(self, T_WS: FloatArray) -> FloatArray:
        """Return the arm's goals T_TF (n, 4, 4) at locations (n, 4, 4)."""
        return np.ascontiguousarray(self._problem.cell.location_factors(T_WS))

    def rate(self, goals: FloatArray, first_location: int) -> tuple[FloatArray, CodeArray]:
        """Return f_R and reasons, (n_configurations, n, n_angles), of locations that follow one another.

        Args:
            goals: from `goals`.
            first_location: the number of the first of them.
        """
        shape = (len(self.configurations), len(goals), self._angle_count)
        values, reasons = np.empty(shape), np.empty(shape, dtype=np.uint8)
        cells, factors = self._cells._replace(T_TF=goals), self._problem.value.user_factors
        if factors:
            rate_with_user_factors(cells, self._problem.cell.arm, factors, 0, values, reasons, first_location)
        else:
            rate_columns(*cells, 0, values, reasons, *NO_POSES)
        return values, reasons

    def metadata(self, T_WS: FloatArray) -> Mapping[str, object]:
        """Return the metadata of a map of locations (n, 4, 4), without its configuration; see `build_maps`."""
        user_names = [factor.name for factor in self._problem.value.user_factors]
        return {
            "scan": self._problem.name,
            "digest": digest_of(self._cells._replace(T_TF=self.goals(T_WS)), user_names),
            "arm": asdict(self._problem.cell.arm),
            "reasons": reason_texts(self._problem.pair_names, user_names),
        }
