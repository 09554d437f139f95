from pathlib import Path

import numpy as np
import pytest

from planner.planning.dijkstra import dijkstra
from planner.planning.ray_shooting import cheapest_ray, no_cost_to_go, ray_accelerations, ray_shooting
from planner.plans.plan import Plan
from planner.plans.verification import verify
from planner.search.lattice import speed_unit
from planner.search.lattice_choice import turn_lattice
from tools.figures import NAMES, main
from tools.paper_figures import (
    FIGURES,
    MOMENTS,
    OBSTACLE_RAYS,
    OBSTACLES,
    SHARED_SPEED_COUNT,
    SHARED_WORK,
    complete_rays,
    obstacle_problem,
    shared_problem,
)

# Between the second obstacle's samples, in degrees, and halfway along it.
SECOND_OBSTACLE_DEG, SECOND_OBSTACLE_LOCATION = (54.0, 144.0), 64


def test_the_command_line_names_every_figure() -> None:
    assert list(FIGURES) == list(NAMES)


def shot() -> Plan:
    """Return the plan of Fig. 8."""
    plan = ray_shooting(obstacle_problem(), OBSTACLE_RAYS)
    assert isinstance(plan, Plan)
    return plan


def ways_at(moment: int) -> set[str]:
    """Return on which sides of the second obstacle the rays from the plan's state at a time pass both obstacles."""
    rays = complete_rays(obstacle_problem(), shot(), moment)
    at_obstacle = [ray[min(SECOND_OBSTACLE_LOCATION - moment, len(ray) - 1)] for ray in rays]
    return {"left" if angle < SECOND_OBSTACLE_DEG[0] else "between" for angle in at_obstacle}


def test_the_rays_first_see_a_way_left_of_both_obstacles_then_one_between_them() -> None:
    assert ways_at(MOMENTS[0]) == {"left"}
    assert ways_at(MOMENTS[1]) == {"left", "between"}


def test_of_the_two_ways_the_cheaper_is_taken_and_the_rotation_reverses() -> None:
    problem = obstacle_problem()
    plan = shot()
    accelerations = ray_accelerations(OBSTACLE_RAYS.rays, problem.limits.acceleration_deg_s2)
    chosen = []
    for moment in MOMENTS[:2]:
        state = float(plan.angles_deg[moment]), float(plan.speeds_deg_s[moment])
        empty = no_cost_to_go(problem)
        best = cheapest_ray(problem.terms, accelerations, moment, OBSTACLE_RAYS.horizon, empty, *state)
        chosen.append(accelerations[best])
    assert chosen[0] < 0.0 < chosen[1] < abs(chosen[0])
    assert plan.angles_deg[SECOND_OBSTACLE_LOCATION] > SECOND_OBSTACLE_DEG[1]
    assert plan.speeds_deg_s.min() < 0.0 < plan.speeds_deg_s[SECOND_OBSTACLE_LOCATION]
    assert verify(problem, plan).is_executable
    assert plan.pauses == ()


def test_the_path_of_fig_7_is_a_motion_of_a_lattice_that_has_the_speed_limit() -> None:
    problem = shared_problem()
    lattice = turn_lattice(problem, SHARED_SPEED_COUNT, SHARED_WORK)
    assert lattice is not None
    assert lattice.half_count * speed_unit(lattice, problem.step_s) == pytest.approx(problem.limits.speed_deg_s)
    plan = dijkstra(problem, lattice)
    assert isinstance(plan, Plan)
    assert verify(problem, plan).is_executable


@pytest.mark.parametrize("name", ["fig5", "fig6", "fig8", "fig9"])
def test_a_figure_is_drawn_and_the_same_every_time(
    name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    for folder in ("first", "second"):
        assert main(["--out", str(tmp_path / folder), name]) == 0
    assert capsys.readouterr().out.splitlines() == [
        str(tmp_path / folder / f"{name}.png") for folder in ("first", "second")
    ]
    first, second = ((tmp_path / folder / f"{name}.png").read_bytes() for folder in ("first", "second"))
    assert first == second
    assert [path.name for path in (tmp_path / "first").iterdir()] == [f"{name}.png"]


def test_an_unknown_figure_is_refused_in_one_sentence(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as ended:
        main(["fig4"])
    assert ended.value.code == 2
    assert capsys.readouterr().err.startswith("figures: NAME: is fig4; allowed are fig5, fig6")


def test_a_folder_that_cannot_be_made_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "file").write_text("", encoding="utf-8")
    assert main(["--out", str(tmp_path / "file" / "below"), "fig5"]) == 2
    assert "the figures cannot be written there" in capsys.readouterr().err


def test_every_figure_of_the_planner_is_there() -> None:
    assert list(FIGURES) == [f"fig{number}" for number in np.arange(5, 10)]


def test_the_captions_of_fig_8_are_true() -> None:
    figure = FIGURES["fig8"]()
    drawn = [{str(line.get_label()): line.get_xydata() for line in axes.lines} for axes in figure.axes]
    cheapest = [dict(np.asarray(each["cheapest ray"])) for each in drawn]
    captions = [axes.get_title() for axes in figure.axes]
    free = complete_rays(obstacle_problem(), shot(), MOMENTS[0])

    assert "every free ray passes below both" in captions[0]
    first, second = ((first, first_angle * 3.0) for first, _, first_angle, _ in OBSTACLES)
    assert all(ray[first[0]] < first[1] and ray[second[0]] < second[1] for ray in free)
    assert "the cheapest ray passes between" in captions[1]
    assert "above the second" in captions[2]
    for ray in cheapest[1:3]:
        assert ray[SECOND_OBSTACLE_LOCATION] > SECOND_OBSTACLE_DEG[1]
    assert cheapest[1][MOMENTS[2]] < first[1]
    assert "past both" in captions[3]
    assert MOMENTS[3] > max(last for _, last, *_ in OBSTACLES)


@pytest.mark.parametrize("name", ["fig5", "fig6", "fig8", "fig9"])
def test_a_figure_has_its_number_in_its_title(name: str) -> None:
    figure = FIGURES[name]()
    titles = [figure.get_suptitle(), *(axes.get_title() for axes in figure.axes)]
    assert sum(title.startswith(f"Fig. {name[3:]}: ") for title in titles) == 1
