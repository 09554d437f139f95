"""The plot of the arm's motion along a plan: each joint between its limits, and its speed below its maximum."""

from pathlib import Path

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from planner.plans.arm_motion import ArmMotion
from planner.plot_style import BLUE, LIMIT, VERMILION, new_figure, save_picture, styled


@styled()
def arm_figure(motion: ArmMotion, title: str) -> Figure:
    """Return the angle and the speed of each joint along a plan, with limits and margins."""
    figure = new_figure(10.8)
    rows = figure.subplots(6, 2, sharex=True)
    for joint, (angle, speed) in enumerate(rows):
        _draw_angle(angle, motion, joint)
        _draw_speed(speed, motion, joint)
        if motion.step is not None:
            for axes in (angle, speed):
                axes.axvline(motion.step, color=VERMILION, linewidth=1.0)
    rows[0, 0].set_title("angle (deg)", fontsize="medium")
    rows[0, 1].set_title("speed (deg/s)", fontsize="medium")
    for axes in rows[-1]:
        axes.set_xlabel("scan location")
    figure.suptitle(title)
    return figure


def plot_arm(motion: ArmMotion, title: str, file: Path) -> None:
    """Write the plot of the arm's motion to `file`, which appears when it is complete."""
    save_picture(arm_figure(motion, title), file)


def _draw_angle(axes: Axes, motion: ArmMotion, joint: int) -> None:
    lower, upper = motion.arm.lower_deg[joint], motion.arm.upper_deg[joint]
    axes.plot(motion.robot_deg[:, joint], color=BLUE)
    _draw_limits(axes, (lower, upper), upper - lower)
    axes.set_title(f"margin {motion.limit_margins_deg[joint]:.1f} deg", loc="right", fontsize="small")
    axes.set_ylabel(f"joint {joint + 1}")


def _draw_speed(axes: Axes, motion: ArmMotion, joint: int) -> None:
    limit = motion.arm.max_speed_deg_s[joint]
    axes.stairs(motion.speeds_deg_s[1:, joint], color=BLUE, baseline=None)
    _draw_limits(axes, (0.0, limit), limit)
    axes.set_title(f"margin {motion.speed_margins_deg_s[joint]:.1f} deg/s", loc="right", fontsize="small")


def _draw_limits(axes: Axes, limits: tuple[float, float], width: float) -> None:
    for limit in limits:
        axes.axhline(limit, **LIMIT)
    axes.set_ylim(limits[0] - 0.1 * width, limits[1] + 0.1 * width)
