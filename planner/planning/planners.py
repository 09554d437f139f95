"""All planners by name."""

from collections.abc import Mapping
from types import MappingProxyType

from planner.defaults import PLANNER_NAMES
from planner.planning.arm_planning import obeying_the_arm
from planner.planning.dijkstra import dijkstra
from planner.planning.dynamic_programming import dynamic_programming
from planner.planning.local_maxima import local_maxima
from planner.planning.ray_shooting import guided_ray_shooting, ray_shooting
from planner.planning.receding import receding
from planner.planning.rotate_when_blocked import rotate_when_blocked
from planner.plans.plan import Planner

PLANNERS: Mapping[str, Planner] = MappingProxyType(
    dict(
        zip(
            PLANNER_NAMES,
            (
                obeying_the_arm(dynamic_programming),
                receding,
                guided_ray_shooting,
                ray_shooting,
                rotate_when_blocked,
                dijkstra,
                local_maxima,
            ),
            strict=True,
        )
    )
)
