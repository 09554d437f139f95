"""A planner of your own: a function from a `Problem` to a `Plan` or a `NoPlan`. This one turns at a constant speed.

As an installed plug-in it has a name for `plan --planner constant_speed`, and a line in `plan --compare`:

    [project.entry-points."seventh_axis.planners"]
    constant_speed = "my_package:constant_speed"
"""

import numpy as np

import planner


def constant_speed(problem: planner.Problem) -> planner.Plan | planner.NoPlan:
    """Speed up in the first step, then keep the speed: the best of all starts and speeds that stay allowed."""
    n, step_s, free = problem.step_count, problem.step_s, problem.map.allowed
    fastest = min(problem.limits.speed_deg_s, problem.limits.acceleration_deg_s2 * step_s)
    best = None
    for speed in np.linspace(-fastest, fastest, 81):
        travelled = speed * step_s * np.concatenate(([0.0], np.arange(n) + 0.5))
        for start in problem.map.angles_deg if problem.start_angle_deg is None else [problem.start_angle_deg]:
            angles = start + travelled
            cells = np.floor(angles / problem.map.angle_step_deg).astype(int) % problem.map.angle_count
            if free[np.arange(n + 1), cells].all():
                accelerations = np.concatenate(([speed / step_s], np.zeros(n - 1)))
                speeds = np.concatenate(([0.0], np.full(n, speed)))
                plan = planner.make_plan(problem, "constant_speed", angles, speeds, accelerations)
                best = plan if best is None or plan.cost.total < best.cost.total else best
    return best or planner.NoPlan("constant_speed", planner.Infeasibility.NOT_FOUND)


scan = planner.load_scan("cylinder")
for chosen in (constant_speed, "dynamic_programming"):
    planned = planner.plan(scan, planner=chosen, configuration="LEFTY-ABOVE-NOFLIP", angle_count=90)
    assert isinstance(planned, planner.PlannedScan)
    print(f"{planned.plan.planner:20} cost {planned.plan.cost.total:.2f}, executable: {planned.is_executable}")
