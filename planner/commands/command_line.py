"""The command line of `python -m planner`, parsed without loading the code of the commands."""

import argparse
import math
from pathlib import Path

from planner.defaults import (
    AXES,
    DEFAULT_ANGLES,
    DEFAULT_PLANNER,
    LAG_S,
    LEAD_S,
    MILLIMETERS,
    MOST_STRIPS,
    PART_CLASSES,
    PATTERN_NAMES,
    PLANNER_NAMES,
    PROFILES_HZ,
    RAY_SHOOTING,
    RECEDING,
    REPORT_FILE,
    RUN_ON_DEG,
    SHARE_SEEN,
    TOLERANCE_DEG,
    shipped_scans,
)
from planner.plug_ins import PLANNER_GROUP, plug_in_names
from protocol.files.data_file import did_you_mean
from protocol.program.command_line import Parser, program_name
from protocol.program.number_options import number, positive_number, share, whole_number

_Commands = "argparse._SubParsersAction[Parser]"


def parser() -> Parser:
    """Return the parser; its result has the name of the command in `command`."""
    top = Parser(
        prog=_program(),
        description="Plan the motion of a rotary table under a scanning robot arm.",
        epilog=f"examples: {_program()} new-scan part.stl --out part.toml; {_program()} map mould --out build/mould",
    )
    commands = top.add_subparsers(title="commands", metavar="COMMAND", dest="command", required=True)
    _add_map(commands)
    _add_plan(commands)
    _add_run(commands)
    _add_track(commands)
    _add_scan(commands)
    _add_show(commands)
    _add_new_scan(commands)
    return top


def _program() -> str:
    return program_name("planner")


def _add_map(commands: "argparse._SubParsersAction[Parser]") -> None:
    parser = commands.add_parser(
        "map",
        help="compute and draw a scan's configuration map",
        description="Rate every location of a scan at every table angle, and explain forbidden poses.",
        epilog=f"example: {_program()} map mould --configuration LEFTY-ABOVE-NOFLIP --out build/mould",
    )
    _add_scan_option(parser)
    _add_map_option(parser, configuration="all")
    parser.add_argument("--out", type=Path, required=True, metavar="DIR", help="folder for the map and its pictures")


def _add_plan(commands: "argparse._SubParsersAction[Parser]") -> None:
    parser = commands.add_parser(
        "plan",
        help="plan the table's motion along a scan",
        description="Choose the table's motion across a scan's configuration map. Exit status 1 where there is none,"
        " or none that the arm can follow.",
        epilog=f"example: {_program()} plan mould --compare --out build/mould",
    )
    _add_scan_option(parser)
    _add_map_option(parser, configuration="best")
    parser.add_argument(
        "--planner",
        type=_planner_name,
        default=DEFAULT_PLANNER,
        metavar="NAME",
        help=f"one of {', '.join(PLANNER_NAMES)}, or an installed plug-in (default: {DEFAULT_PLANNER})",
    )
    parser.add_argument("--start", type=_angle, metavar="DEG", help="table angle at the first location (default: free)")
    parser.add_argument("--smooth", action="store_true", help="lower the plan's acceleration peaks afterwards")
    parser.add_argument("--compare", action="store_true", help="run all planners and print a table of them")
    parser.add_argument(
        "--out", type=Path, required=True, metavar="DIR", help="folder for plan.json, its pictures and the map"
    )


def _add_run(commands: "argparse._SubParsersAction[Parser]") -> None:
    parser = commands.add_parser(
        "run",
        help="carry out a plan on a table, and verify the motion",
        description="Stream a plan to the table at a port; exit status 1 when the motion deviated from the plan.",
        epilog=f"example: {_program()} run build/cylinder/plan.json --port /dev/ttyUSB0 --out build/cylinder/run",
    )
    parser.add_argument("plan", metavar="PLAN.json", type=Path, help=f"a plan from {_program()} plan")
    parser.add_argument("--map", metavar="FILE", type=Path, help="the plan's map (default: map.npz beside the plan)")
    _add_run_options(parser)


def _add_track(commands: "argparse._SubParsersAction[Parser]") -> None:
    parser = commands.add_parser(
        "track",
        help="plan the table while it moves, as scan locations become known",
        description="Decide the table's motion step by step from the locations in view, stream it to the table, and"
        " verify it. The table can come to rest within the view at any moment. Exit status 1 when the motion deviated"
        " from what was decided.",
        epilog=f"example: {_program()} track mould --port emulator:// --view 30 --out build/mould-track",
    )
    _add_scan_option(parser)
    parser.add_argument(
        "--poses",
        metavar="SOURCE",
        help="locations from a program in place of the scan's path, one JSON line each: - for stdin, or"
        " tcp://127.0.0.1:PORT to listen there",
    )
    parser.add_argument(
        "--planner",
        choices=(RECEDING, RAY_SHOOTING),
        default=RECEDING,
        help="who decides each step (default: %(default)s)",
    )
    parser.add_argument(
        "--view",
        type=whole_number(1, 1000),
        default=50,
        metavar="COLUMNS",
        help="locations that are known ahead of the table, at most (default: %(default)s)",
    )
    _add_map_option(parser, configuration="best")
    parser.add_argument(
        "--reconfigure",
        action="store_true",
        help="let a pause change the arm's configuration where the path goes on in no other way",
    )
    parser.add_argument(
        "--wait", type=positive_number, default=60.0, metavar="S",
        help="how long to wait for a location in s (default: %(default)g)",
    )  # fmt: skip
    _add_run_options(parser)


def _add_scan(commands: "argparse._SubParsersAction[Parser]") -> None:
    parser = commands.add_parser(
        "scan",
        help="scan a workpiece with a simulated probe, and compute the error budget of its cloud",
        description="Plan a scan, move the table, take laser profiles and align them to one cloud; exit status 1 when"
        " it ended early.",
        epilog=f"examples: {_program()} scan cylinder --decimals 3 --out build/cylinder;"
        f" {_program()} scan part.toml --adapt 0.99 --out build/part",
    )
    _add_scan_option(parser)
    parser.add_argument("--mesh", type=Path, metavar="FILE", help="replace the workpiece by this mesh")
    parser.add_argument("--unit", choices=tuple(MILLIMETERS), help="unit of length in --mesh (default: mm)")
    parser.add_argument(
        "--port", metavar="URL", default="emulator://",
        help="emulator:// for a table in simulated time (the default), or an emulator's port with --control",
    )  # fmt: skip
    _add_emulator(parser)
    _add_wire(parser)
    _add_lag(parser)
    parser.add_argument(
        "--rate", type=positive_number, default=PROFILES_HZ, metavar="HZ",
        help="laser profiles per second (default: %(default)g)",
    )  # fmt: skip
    _add_run_on(parser)
    _add_map_option(parser, configuration="best")
    parser.add_argument(
        "--exact-calibration", action="store_true", help="align with the true placements instead of calibrated ones"
    )
    _add_adaptive(parser)
    parser.add_argument("--xyz", action="store_true", help="write cloud.xyz as well")
    parser.add_argument(
        "--normals", action="store_true", help="write normals.ply as well: the cloud thinned to 0.5 mm, with normals"
    )
    parser.add_argument(
        "--surface", type=Path, metavar="FILE.ply",
        help="write a triangle mesh of the cloud, by Poisson reconstruction (extra: adaptive)",
    )  # fmt: skip
    parser.add_argument(
        "--seed", type=whole_number(0, 2**31), default=0, metavar="N", help="random seed of the noise (default: 0)"
    )
    parser.add_argument(
        "--out",
        type=Path,
        required=True,
        metavar="DIR",
        help="folder for cloud.ply, poses.csv, scan.json and report.html",
    )


def _add_adaptive(parser: argparse.ArgumentParser) -> None:
    """Add what an adaptive scan is for."""
    parser.add_argument(
        "--adapt", type=share, metavar="SHARE",
        help="after the path, scan strips until this share of what can be seen is seen, such as 0.99"
        f" (default of a scan with pattern adaptive: {SHARE_SEEN:g})",
    )  # fmt: skip
    parser.add_argument(
        "--most-strips", type=whole_number(1, 10_000), default=MOST_STRIPS, metavar="N",
        help="maximum number of adaptive strips (default: %(default)s)",
    )  # fmt: skip
    parser.add_argument(
        "--blind", type=positive_number, nargs=2, metavar=("DIAMETER", "HEIGHT"),
        help="choose the strips without the mesh, inside an approximate cylinder about the z axis of the workpiece's"
        " frame that holds the part, in mm",
    )  # fmt: skip
    parser.add_argument(
        "--turn-over", action="store_true",
        help="lay the part on another face afterwards, scan it again, and join both clouds (extra: adaptive)",
    )  # fmt: skip


def _add_show(commands: "argparse._SubParsersAction[Parser]") -> None:
    parser = commands.add_parser(
        "show",
        help="show a run as one HTML page",
        description="Write a page that shows a run, with everything in it: map, paths, profile, deviations, commands.",
        epilog=f"example: {_program()} show build/cylinder/run",
    )
    parser.add_argument("folder", metavar="DIR", type=Path, help=f"output folder of {_program()} run")
    parser.add_argument("--out", metavar="FILE", type=Path, help=f"the page (default: {REPORT_FILE} in DIR)")


def _add_new_scan(commands: "argparse._SubParsersAction[Parser]") -> None:
    parser = commands.add_parser(
        "new-scan",
        help="write a scan file for a mesh",
        description="Write a commented scan file for a mesh, with a pattern that fits and that can be planned.",
        epilog=f"example: {_program()} new-scan part.stl --out part.toml",
    )
    parser.add_argument("mesh", metavar="MESH", type=Path, help="an STL, PLY or OBJ file with a closed surface")
    parser.add_argument("--unit", choices=tuple(MILLIMETERS), help="unit of length in the file (default: mm)")
    parser.add_argument(
        "--up",
        choices=AXES,
        default="z",
        help="axis of the file that points up, such as --up=-z (default: z)",
    )
    parser.add_argument(
        "--class", dest="kind", choices=PART_CLASSES, help="class of the part (default: guessed from the mesh)"
    )
    parser.add_argument("--pattern", choices=PATTERN_NAMES, help="pattern of the path (default: the first that plans)")
    parser.add_argument("--out", metavar="FILE", type=Path, help="the scan file (default: MESH.toml in this folder)")


def _planner_name(text: str) -> str:
    names = [*PLANNER_NAMES, *(() if text in PLANNER_NAMES else plug_in_names(PLANNER_GROUP))]
    if text not in names:
        raise argparse.ArgumentTypeError(f"is {text}; allowed are {', '.join(names)}{did_you_mean(text, names)}")
    return text


def _angle(text: str) -> float:
    try:
        angle = float(text)
    except ValueError:
        angle = math.nan
    if not math.isfinite(angle):
        raise argparse.ArgumentTypeError(f"is {text}; allowed: any angle in degrees")
    return angle


def _add_scan_option(parser: argparse.ArgumentParser) -> None:
    """Add the argument for the scan."""
    parser.add_argument("scan", metavar="SCAN", help=f"a scan file, or one of {', '.join(shipped_scans())}")


def _add_map_option(parser: argparse.ArgumentParser, configuration: str) -> None:
    """Add the options for the configuration maps to compute and their resolution; `configuration` is the default."""
    parser.add_argument(
        "--configuration",
        metavar="NAME",
        default=configuration,
        help=f"such as LEFTY-ABOVE-NOFLIP, or {configuration} (the default)",
    )
    parser.add_argument(
        "--angles",
        type=whole_number(8, 36_000),
        default=DEFAULT_ANGLES,
        metavar="COUNT",
        help="table angles over one turn (default: %(default)s)",
    )


def _add_run_options(parser: argparse.ArgumentParser) -> None:
    """Add how a motion is run on a table, and where it is recorded."""
    parser.add_argument(
        "--port",
        metavar="URL",
        required=True,
        help="a device, socket://HOST:PORT, or emulator:// for a simulated table",
    )
    parser.add_argument(
        "--out", metavar="DIR", type=Path, required=True, help="folder for run.json, run.csv and run.png"
    )
    _add_wire(parser)
    parser.add_argument(
        "--timeout",
        type=positive_number,
        default=1.0,
        metavar="S",
        help="timeout of a reply in s (default: 1)",
    )
    parser.add_argument(
        "--lead", type=number(-1.0, 1.0), default=LEAD_S, metavar="S",
        help="send commands ahead by the encoder's lag behind the reference: 0.0035 for the emulator (default: 0)",
    )  # fmt: skip
    _add_lag(parser)
    parser.add_argument(
        "--tolerance", type=positive_number, default=TOLERANCE_DEG, metavar="DEG",
        help="allowed encoder deviation at a location in deg (default: %(default)s)",
    )  # fmt: skip
    _add_run_on(parser)
    parser.add_argument(
        "--arm-away",
        action="store_true",
        help="no collision check on the approach: the arm is drawn back until the table is at the start",
    )
    _add_emulator(parser)


def _add_wire(parser: argparse.ArgumentParser) -> None:
    """Add the options of the serial line."""
    parser.add_argument(
        "--baud", type=whole_number(0, 1_000_000), default=9600, metavar="N", help="baud rate (default: 9600)"
    )
    parser.add_argument(
        "--decimals",
        type=whole_number(1, 6),
        default=1,
        metavar="N",
        help="decimal places on the wire (default: 1)",
    )


def _add_run_on(parser: argparse.ArgumentParser) -> None:
    """Add the option for the distance that the table may run on if the line fails."""
    parser.add_argument(
        "--run-on",
        type=positive_number,
        default=RUN_ON_DEG,
        metavar="DEG",
        help="maximum angle that the table runs on if the line fails, if the limits allow it (default: %(default)g)",
    )


def _add_emulator(parser: argparse.ArgumentParser) -> None:
    """Add the time scale and the control channel of an emulator at the port."""
    parser.add_argument(
        "--time-scale",
        type=positive_number,
        default=1.0,
        metavar="X",
        help="time scale of the emulator at --port (default: 1)",
    )
    parser.add_argument(
        "--control",
        type=Path,
        metavar="PATH",
        help="control channel of the emulator at --port, for its reference and true angle",
    )


def _add_lag(parser: argparse.ArgumentParser) -> None:
    """Add the lag of the encoder behind the reference, which is not visible on the serial line."""
    parser.add_argument(
        "--lag", type=number(0.0, 1.0), default=LAG_S, metavar="S",
        help="lag of the encoder behind the table's reference in s (default: %(default)s, for the emulator)",
    )  # fmt: skip
