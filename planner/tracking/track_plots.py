"""Pictures of a tracked path: what was in view at some decisions, as Fig. 8 has it, and how long decisions took."""

from pathlib import Path

import numpy as np
from matplotlib.axes import Axes

from planner.map.map_plots import draw_map
from planner.plans.plan import Plan
from planner.plans.plan_plots import draw_path
from planner.plans.problem import Problem
from planner.plot_style import BLUE, EXECUTED, INK, LIMIT, VERMILION, new_figure, save_picture, styled
from planner.tracking.online_planner import Step
from planner.tracking.track_file import TRACK_PICTURE
from planner.tracking.track_record import TrackRecord

_MOMENTS = 4
_SUB_STEPS = 12


@styled()
def plot_track(problem: Problem, plan: Plan, record: TrackRecord, title: str, folder: Path) -> None:
    """Write the picture of a tracked path; it appears when it is whole."""
    moments = [
        record.moments[i] for i in np.linspace(0, len(record.moments) - 1, _MOMENTS + 2).round().astype(int)[1:-1]
    ]
    figure = new_figure(2.1 * len(moments) + 2.2)
    *maps, times = figure.subplots(len(moments) + 1, 1)
    for axes, step in zip(maps, moments, strict=True):
        draw_moment(axes, problem, plan, step)
    maps[0].legend(loc="lower right", fontsize=8, frameon=True, ncols=2)
    maps[-1].set_xlabel("scan location")
    draw_decision_times(times, record)
    figure.suptitle(title)
    save_picture(figure, folder / TRACK_PICTURE)


def draw_moment(axes: Axes, problem: Problem, plan: Plan, step: Step) -> None:
    """Draw what was known at a decision: the way so far, the view, the step and the kept motion to rest."""
    draw_map(axes, problem.map)
    here, last = step.start.location, min(step.last_known, problem.step_count)
    axes.axvspan(last + 0.5, problem.step_count + 0.5, color=INK, alpha=0.55, linewidth=0.0)
    axes.axvspan(-0.5, here - 0.5, color="white", alpha=0.55, linewidth=0.0)
    draw_path(axes, plan.angles_deg[: here + 1], "so far", **EXECUTED)
    locations, angles = _sampled(problem, step)
    axes.plot(locations, np.mod(angles, 360.0), ".", color=VERMILION, markersize=2.5, label="step, and motion to rest")
    axes.plot(here, step.start.angle_deg % 360.0, "o", color=BLUE, markersize=5)
    axes.set_xlim(-0.5, problem.step_count + 0.5)
    rest = f"rest at {step.rest.location}" if step.kept else "at rest"
    axes.set_title(f"location {here}, {last} is the last known, {step.start.speed_deg_s:.1f} deg/s, {rest}", loc="left")


def draw_decision_times(axes: Axes, record: TrackRecord) -> None:
    """Draw how long each decision took."""
    times_ms = 1000.0 * np.array(record.decision_s)
    axes.plot(times_ms, ".", color=BLUE, markersize=3)
    axes.axhline(float(np.median(times_ms)), **LIMIT)
    axes.set(ylabel="decision (ms)", xlabel="step", ylim=(0.0, None))


def _sampled(problem: Problem, step: Step) -> tuple[list[float], list[float]]:
    """Return locations and angles along a step and the kept motion after it."""
    locations, angles, state = [], [], step.start
    moving = [(each.acceleration_deg_s2, each.end) for each in step.kept if not each.halts]
    for acceleration, end in ((step.acceleration_deg_s2, step.end), *moving):
        for share in np.linspace(0.0, 1.0, _SUB_STEPS):
            time_s = float(share) * problem.step_s
            locations.append(state.location + float(share) * (end.location - state.location))
            angles.append(state.angle_deg + state.speed_deg_s * time_s + 0.5 * acceleration * time_s**2)
        state = end
    return locations, angles
