"""The columns of a configuration map that are known: those in view ahead of the table, in flat memory.

Columns are revealed one after another and forgotten behind the table. What the planning kernels need of a column (its
free runs, its costs on the grid) is laid out once, when it is revealed.
"""

from typing import NamedTuple

import numpy as np

from planner.arrays import CostArray, FloatArray
from planner.errors import PlannerError
from planner.map.config_map import DEFAULT_EPSILON, ConfigurationMap
from planner.planning.receding import OnlineStep, prepare_online_step
from planner.plans.crossing import RunArray, free_runs, free_runs_down
from planner.plans.problem import Problem, Terms
from planner.search.cost_to_go import lay_out_columns
from planner.table.cost import Weights
from planner.table.motion import Limits

# Of the cost-to-go: with 360 angles and 50 columns in view it takes 0.7 ms, and a path costs up to 2 % too much.
SPEED_COUNT, JUMP_COUNT = 21, 9


class WindowError(PlannerError):
    """A location sent ahead of the window, or a window without room for a step."""


class Window(NamedTuple):
    """The known columns from one location on, as the kernels take them; the location itself is column 0.

    Attributes:
        terms: values, free runs, limits and weights.
        node_cost: (n + 1, n_angles) costs of the columns on the grid.
        sweep: (n, n_angles) how far one may sweep in each step.
    """

    terms: Terms
    node_cost: CostArray
    sweep: RunArray

    @property
    def last(self) -> int:
        """The last known column, counted from the window's first."""
        return len(self.sweep)


class RevealedMap:
    """The known part of a map in one arm configuration.

    Attributes:
        first: the first location that is kept.
        count: how many locations were revealed: the next one has this number.
        online: what the receding planner lays out once.
    """

    def __init__(
        self, angle_count: int, step_s: float, limits: Limits, weights: Weights | None, view: int, first: int = 0
    ) -> None:
        """Make room for `view` columns ahead of the present one, the first of them at location `first`.

        Raises:
            WindowError: the view is below 1 column.
        """
        if view < 1:
            raise WindowError(f"the view is {view} columns; allowed is 1 or more")
        open_columns = ConfigurationMap(np.ones((2, angle_count)))
        problem = Problem(open_columns, step_s, limits, weights, None, None)
        self.online: OnlineStep = prepare_online_step(problem, SPEED_COUNT, JUMP_COUNT)
        self.first, self.count, self._view = first, first, view
        self._terms = problem.terms
        # The columns in view are contiguous; when the room ends they move to its beginning.
        room = 2 * (view + 2)
        self._values: FloatArray = np.empty((room, angle_count))
        self._node_cost: CostArray = np.empty((room, angle_count), dtype=np.float32)
        self._runs: RunArray = np.empty((room, angle_count), dtype=np.int32)
        self._runs_down, self._sweep = np.empty_like(self._runs), np.empty_like(self._runs)
        self._begin = 0

    @property
    def last(self) -> int:
        """The last known location; one before the first where none is known."""
        return self.count - 1

    @property
    def room(self) -> int:
        """How many locations may be revealed now."""
        return self.first + self._view + 1 - self.count

    def reveal(self, values: FloatArray) -> None:
        """Take the next column, (n_angles,) of f_R.

        Raises:
            WindowError: it lies ahead of the window.
        """
        if self.room < 1:
            raise WindowError(
                f"location {self.count} is ahead of the window, which ends {self._view} locations ahead of the table,"
                f" at {self.last}; send a location when there is room for it"
            )
        place = self._begin + self.count - self.first
        if place == len(self._values):
            place = self._move_to_front()
        self._values[place] = values
        self.count += 1
        since = max(place - 1, self._begin)
        self._lay_out(since, place + 1)

    def forget_before(self, location: int) -> None:
        """Forget the columns behind the table."""
        self._begin += location - self.first
        self.first = location

    def column(self, location: int) -> FloatArray:
        """Return the (n_angles,) values of a location that is kept."""
        column: FloatArray = self._values[self._begin + location - self.first]
        return column

    def window(self, location: int) -> Window:
        """Return the known columns from a location on."""
        begin, end = self._begin + location - self.first, self._begin + self.count - self.first
        terms = self._terms._replace(
            values=self._values[begin:end], runs=self._runs[begin : end - 1], runs_down=self._runs_down[begin : end - 1]
        )
        return Window(terms, self._node_cost[begin:end], self._sweep[begin : end - 1])

    def _move_to_front(self) -> int:
        kept = self.count - self.first
        for array in (self._values, self._node_cost, self._runs, self._runs_down, self._sweep):
            array[:kept] = array[self._begin : self._begin + kept].copy()
        self._begin = 0
        return kept

    def _lay_out(self, begin: int, end: int) -> None:
        """Lay out the last column and the step to it; the first column of all has no step."""
        values = self._values[begin:end]
        allowed = values > DEFAULT_EPSILON
        runs, runs_down = free_runs(allowed), free_runs_down(allowed)
        terms = self._terms._replace(values=values, runs=runs, runs_down=runs_down)
        node_cost, sweep = lay_out_columns(terms, self.online.grid, self.online.unit)
        self._node_cost[end - 1] = node_cost[-1]
        if end - begin == 2:
            self._runs[begin], self._runs_down[begin], self._sweep[begin] = runs[0], runs_down[0], sweep[0]
