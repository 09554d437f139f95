"""`python -m planner map`: compute a scan's configuration maps, draw them, and print what can be reached."""

import argparse
import sys
from collections.abc import Mapping, Sequence
from itertools import groupby
from pathlib import Path

from planner.cell.scan import load_scan
from planner.cell.unit_hints import unit_hint
from planner.commands import options
from planner.errors import PlannerError
from planner.kinematics.configuration import Configuration
from planner.map.config_map import ConfigurationMap
from planner.map.map_builder import build_maps, is_compiled
from planner.map.map_file import MAP_FILE, save_maps
from planner.map.map_plots import plot_map, plot_map_cylinder
from planner.map.map_problem import map_problem
from planner.set_aside import set_aside
from protocol.program.progress import progress_line

MAP_RESULTS = (MAP_FILE, "map.png", "map_cylinder.png")


def run(arguments: argparse.Namespace) -> int:
    """Write `map.npz`, `map.png` and `map_cylinder.png`, print a summary, and return the exit status."""
    set_aside(arguments.out, MAP_RESULTS)
    configurations = (
        list(Configuration) if arguments.configuration == "all" else [Configuration.parse(arguments.configuration)]
    )
    scan = load_scan(arguments.scan, options.say, progress_line("mesh", sys.stderr))
    problem = map_problem(scan, progress_line("distance field", sys.stderr))
    label = "map" if is_compiled() else "map (compiling, once)"
    maps = build_maps(problem, configurations, arguments.angles, progress_line(label, sys.stderr))
    drawn = most_reachable(maps)
    out: Path = arguments.out
    try:
        out.mkdir(parents=True, exist_ok=True)
        save_maps(out / MAP_FILE, maps)
        plot_map(maps[drawn], out / "map.png")
        plot_map_cylinder(maps[drawn], out / "map_cylinder.png")
    except OSError as error:
        raise PlannerError(f"{out}: cannot write the map ({error.strerror or error})") from error
    sys.stdout.write(summary(problem.name, maps, drawn))
    if not any(each.allowed.any() for each in maps.values()) and (hint := unit_hint(scan)) is not None:
        sys.stdout.write(f"nothing can be reached: {hint}\n")
    return 0


def most_reachable(maps: Mapping[Configuration, ConfigurationMap]) -> Configuration:
    """Return the configuration in which most locations can be reached; of equal ones, that with the best values."""

    def merit(configuration: Configuration) -> tuple[int, float]:
        each = maps[configuration]
        return -len(each.blocked_locations), float(each.values.max(axis=1).mean())

    return max(maps, key=merit)


def summary(name: str, maps: Mapping[Configuration, ConfigurationMap], drawn: Configuration) -> str:
    """Return a summary of the maps, one line for each configuration."""
    shape = maps[drawn]
    lines = [
        f"{name}: {shape.location_count} locations, {shape.angle_count} table angles",
        f"{'configuration':20} {'cells allowed':>13} {'path reachable':>14}  locations reachable at no table angle",
    ]
    for configuration, each in maps.items():
        blocked = each.blocked_locations
        reachable = 1.0 - len(blocked) / each.location_count
        lines.append(
            f"{configuration.label:20} {each.allowed.mean():13.1%} {reachable:14.1%}  {_ranges(blocked) or 'none'}"
        )
    lines.append(f"drawn: {drawn.label}")
    return "\n".join(lines) + "\n"


def _ranges(numbers: Sequence[int]) -> str:
    """Return ascending numbers with consecutive ones as ranges: 1-3, 7."""
    runs = [[number for _, number in run] for _, run in groupby(enumerate(numbers), lambda item: item[1] - item[0])]
    return ", ".join(str(run[0]) if len(run) == 1 else f"{run[0]}-{run[-1]}" for run in runs)
