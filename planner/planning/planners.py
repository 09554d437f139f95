"""All planners by name."""

from collections.abc import Mapping
from types import MappingProxyType

from planner.planning import (
    arm_planning,
    dijkstra,
    dynamic_programming,
    local_maxima,
    ray_shooting,
    receding,
    rotate_when_blocked,
)
from planner.planning.plan import Planner

DEFAULT_PLANNER = dynamic_programming.NAME

PLANNERS: Mapping[str, Planner] = MappingProxyType(
    {
        dynamic_programming.NAME: arm_planning.obeying_the_arm(dynamic_programming.dynamic_programming),
        receding.NAME: receding.receding,
        ray_shooting.GUIDED_NAME: ray_shooting.guided_ray_shooting,
        ray_shooting.NAME: ray_shooting.ray_shooting,
        rotate_when_blocked.NAME: rotate_when_blocked.rotate_when_blocked,
        dijkstra.NAME: dijkstra.dijkstra,
        local_maxima.NAME: local_maxima.local_maxima,
    }
)
