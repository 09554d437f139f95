"""The paper's figures of the planner, drawn; see `tools.figures`."""

from collections.abc import Callable, Mapping
from dataclasses import replace

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.image import AxesImage
from mpl_toolkits.mplot3d.axes3d import Axes3D  # type: ignore[import-untyped]  # matplotlib has no types for it

from planner.arrays import FloatArray
from planner.kinematics.value import joint_factor
from planner.map.config_map import ConfigurationMap
from planner.map.synthetic_maps import MapFamily, blocks_map, synthetic_map
from planner.planning.dijkstra import dijkstra
from planner.planning.dynamic_programming import dynamic_programming
from planner.planning.local_maxima import local_maxima
from planner.planning.ray_shooting import Rays, cheapest_ray, no_cost_to_go, ray_accelerations, ray_shooting
from planner.plans.crossing import step_is_allowed
from planner.plans.plan import Outcome, Plan
from planner.plans.plan_plots import PATH, draw_motion, draw_path
from planner.plans.problem import Problem
from planner.plot_style import AMBER, BLUE, SKY, VERMILION, new_figure, styled
from planner.search.lattice_choice import turn_lattice
from planner.table.cost import Weights
from planner.table.motion import Limits, limited_acceleration, next_angle, next_speed

# The joint whose factor Fig. 5 shows: joint 1 of the arm.
JOINT_RANGE_DEG = (-170.0, 170.0)
EXPONENTS = (0.1, 0.2, 0.5, 1.0, 2.0, 5.0)

# Fig. 6, 7 and 9 share one map. Each step of the graph of Fig. 7 ends exactly on a node, so that the table can execute
# the path in the graph. It has 10 speeds in each direction, including the limit itself.
SHARED_FAMILY, SHARED_SEED = MapFamily(0.42, 6.0, 0.3), 11
SHARED_STEP_S, SHARED_LIMITS = 0.5, Limits(36.0, 36.0)
SHARED_SPEED_COUNT, SHARED_WORK = 10, 100_000

# Fig. 8: obstacles as (first location, last location, first angle, last angle), samples of 3 deg.
OBSTACLES = [(26, 40, 56, 112), (56, 72, 18, 48)]
OBSTACLES_EDGE = 5
MOMENTS = (0, 14, 30, 80)
OBSTACLE_RAYS = Rays(31, 62)


def shared_problem() -> Problem:
    """Return the problem of Fig. 6, 7 and 9; it has the start of the best plan."""
    free = Problem(synthetic_map(SHARED_FAMILY, SHARED_SEED), SHARED_STEP_S, SHARED_LIMITS)
    return replace(free, start_angle_deg=float(_plan(dynamic_programming(free)).angles_deg[0]))


def obstacle_problem() -> Problem:
    """Return the problem of Fig. 8: at first, the only visible path is left of (below) both obstacles."""
    return Problem(
        blocks_map(96, 120, OBSTACLES, OBSTACLES_EDGE),
        step_s=0.2,
        limits=Limits(40.0, 10.0),
        weights=Weights(0.02, 0.0005),
        start_angle_deg=186.0,
    )


@styled()
def figure_5() -> Figure:
    """Shape of Eq. (1) for several exponents."""
    figure = new_figure(4.0, 6.4)
    axes = figure.subplots()
    lower, upper = JOINT_RANGE_DEG
    angles = np.linspace(lower, upper, 1001)
    for exponent in EXPONENTS:
        factor = [joint_factor(float(angle), lower, upper, exponent) for angle in angles]
        axes.plot(angles, factor, label=f"$\\gamma$ = {exponent:g}")
    axes.set(xlabel="joint angle (deg)", ylabel="$f_j$", xlim=JOINT_RANGE_DEG, ylim=(0.0, 1.05))
    axes.set_title("Fig. 5: a joint's factor over its range, Eq. (1)")
    axes.legend(loc="lower center", ncols=2)
    return figure


@styled()
def figure_6() -> Figure:
    """Return a grayscale configuration map with a solution: (a) 2D, (b) cylindrical view."""
    problem = shared_problem()
    plan = _plan(dynamic_programming(problem))
    figure = new_figure(4.8, 11.0)
    flat = figure.add_subplot(1, 2, 1)
    image = _draw_map(flat, problem.map)
    draw_path(flat, plan.angles_deg, **PATH)
    flat.set_title("(a) 2D view")
    figure.colorbar(image, ax=flat, label="$f_R$", shrink=0.85)
    round_view = figure.add_subplot(1, 2, 2, projection="3d")
    assert isinstance(round_view, Axes3D)
    _draw_cylinder(round_view, problem.map, plan.angles_deg)
    round_view.set_title("(b) cylindrical view")
    figure.suptitle("Fig. 6: configuration map with a plan")
    return figure


@styled()
def figure_7() -> Figure:
    """Position, speed and acceleration of the path that Dijkstra's algorithm finds."""
    problem = shared_problem()
    lattice = turn_lattice(problem, SHARED_SPEED_COUNT, SHARED_WORK)
    return _motion_figure(dijkstra(problem, lattice), "Fig. 7: Dijkstra's algorithm on the graph of Eq. (8)")


@styled()
def figure_8() -> Figure:
    """Ray shooting at four times: first a path below both obstacles, then one between them, which is cheaper."""
    problem = obstacle_problem()
    plan = _plan(ray_shooting(problem, OBSTACLE_RAYS))
    figure = new_figure(7.4, 10.5)
    titles = (
        "(a) every free ray passes below both obstacles",
        "(b) the cheapest ray passes between the obstacles",
        "(c) below the first obstacle: the cheapest ray passes above the second",
        "(d) past both obstacles",
    )
    for axes, label, moment in zip(figure.subplots(2, 2, sharex=True, sharey=True).flat, titles, MOMENTS, strict=True):
        _draw_map(axes, problem.map)
        _draw_rays(axes, problem, plan, moment)
        axes.plot(plan.angles_deg[: moment + 1], color=BLUE, linewidth=2.2, label="planned so far")
        axes.plot(moment, plan.angles_deg[moment], "o", color=BLUE, markersize=6)
        axes.set_title(label, fontsize=10)
        axes.label_outer()
    figure.axes[0].legend(loc="lower left", fontsize=8, frameon=True, framealpha=0.9)
    figure.suptitle("Fig. 8: ray shooting at four moments")
    return figure


@styled()
def figure_9() -> Figure:
    """Position, speed and acceleration with ray shooting."""
    return _motion_figure(ray_shooting(shared_problem()), "Fig. 9: ray shooting")


@styled()
def _motion_figure(outcome: Outcome, title: str) -> Figure:
    problem, plan = shared_problem(), _plan(outcome)
    figure = new_figure(8.4, 7.2)
    on_map, speed, acceleration = figure.subplots(3, 1, sharex=True, height_ratios=(2.0, 1.0, 1.0))
    _draw_map(on_map, problem.map)
    brightest = _plan(local_maxima(problem)).angles_deg
    on_map.plot(brightest % 360.0, ".", color=AMBER, markersize=3, label="local maxima")
    draw_path(on_map, plan.angles_deg, "plan", **PATH)
    on_map.legend(loc="upper right", fontsize=8, frameon=True)
    on_map.set(xlabel="", title=f"{title}: cost {plan.cost.total:.1f}")
    draw_motion(speed, acceleration, problem, plan)
    return figure


def _plan(outcome: Outcome) -> Plan:
    assert isinstance(outcome, Plan), outcome
    return outcome


def _draw_map(axes: Axes, configuration_map: ConfigurationMap) -> AxesImage:
    step = configuration_map.angle_step_deg
    extent = (-0.5, configuration_map.location_count - 0.5, -0.5 * step, 360.0 - 0.5 * step)
    image = axes.imshow(
        configuration_map.values.T, cmap="gray", vmin=0.0, vmax=1.0, origin="lower", aspect="auto", extent=extent
    )
    axes.set(xlabel="scan location", ylabel="table angle (deg)", yticks=range(0, 361, 60))
    axes.grid(visible=False)
    return image


def _draw_cylinder(axes: Axes3D, configuration_map: ConfigurationMap, angles_deg: FloatArray) -> None:
    """Draw the map on a cylinder along the scan path, rotated so that the path faces the viewer."""
    elevation, azimuth = np.radians(25.0), np.radians(-62.0)
    towards_reader = np.arctan2(np.sin(elevation), np.sin(azimuth) * np.cos(elevation))
    offset = towards_reader - np.radians(0.5 * (angles_deg.min() + angles_deg.max()))
    locations = np.arange(configuration_map.location_count)
    turn = np.radians(np.linspace(0.0, 360.0, configuration_map.angle_count + 1)) + offset
    x, around = np.meshgrid(locations, turn, indexing="ij")
    shade = configuration_map.values[:-1, :, None].repeat(3, axis=2)
    axes.plot_surface(
        x, np.cos(around), np.sin(around), facecolors=shade, rstride=1, cstride=1, shade=False, antialiased=False
    )
    path = np.radians(angles_deg) + offset
    height = np.where(np.cos(path - towards_reader) > 0.05, 1.02, np.nan)
    axes.plot(locations, height * np.cos(path), height * np.sin(path), color=VERMILION, linewidth=2.5, zorder=10)
    axes.set_box_aspect((2.2, 1.0, 1.0), zoom=1.3)
    axes.view_init(elev=float(np.degrees(elevation)), azim=float(np.degrees(azimuth)))
    axes.set(xlabel="scan location", yticks=[], zticks=[])


def _draw_rays(axes: Axes, problem: Problem, plan: Plan, moment: int) -> None:
    """Draw each ray from the state at a time, as far as it is allowed; the chosen one in the plan's color."""
    accelerations = ray_accelerations(OBSTACLE_RAYS.rays, problem.limits.acceleration_deg_s2)
    state = float(plan.angles_deg[moment]), float(plan.speeds_deg_s[moment])
    empty = no_cost_to_go(problem)
    chosen = cheapest_ray(problem.terms, accelerations, moment, OBSTACLE_RAYS.horizon, empty, *state)
    rays = [_ray(problem, float(acceleration), moment, *state) for acceleration in accelerations]
    for ray in rays:
        axes.plot(np.arange(moment, moment + len(ray)), ray, color=SKY, linewidth=0.9)
    best = rays[chosen]
    axes.plot(np.arange(moment, moment + len(best)), best, color=VERMILION, linewidth=2.0, label="cheapest ray")
    axes.plot([], [], color=SKY, linewidth=0.9, label="rays")
    axes.set_ylim(0.0, 359.0)


def _ray(problem: Problem, acceleration: float, column: int, angle_deg: float, speed_deg_s: float) -> list[float]:
    """Return the angles of a ray up to its horizon or to the forbidden region."""
    terms, angles = problem.terms, [angle_deg]
    for k in range(column, min(column + OBSTACLE_RAYS.horizon, problem.step_count)):
        a = limited_acceleration(speed_deg_s, acceleration, terms.step_s, terms.speed_limit_deg_s)
        if not step_is_allowed(terms.runs, k, angle_deg, speed_deg_s, a, terms.step_s):
            break
        angle_deg = next_angle(angle_deg, speed_deg_s, a, terms.step_s)
        speed_deg_s = next_speed(speed_deg_s, a, terms.step_s)
        angles.append(angle_deg)
    return angles


def complete_rays(problem: Problem, plan: Plan, moment: int) -> list[list[float]]:
    """Return the rays from the plan's state at a time that stay allowed up to their horizon."""
    accelerations = ray_accelerations(OBSTACLE_RAYS.rays, problem.limits.acceleration_deg_s2)
    state = float(plan.angles_deg[moment]), float(plan.speeds_deg_s[moment])
    rays = [_ray(problem, float(acceleration), moment, *state) for acceleration in accelerations]
    return [ray for ray in rays if len(ray) == min(OBSTACLE_RAYS.horizon, problem.step_count - moment) + 1]


FIGURES: Mapping[str, Callable[[], Figure]] = {
    "fig5": figure_5,
    "fig6": figure_6,
    "fig7": figure_7,
    "fig8": figure_8,
    "fig9": figure_9,
}
