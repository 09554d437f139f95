"""The errors that the planner raises for invalid input.

Each message is one sentence with the problem, its place, and the allowed values, so that a command line can print it
directly. If valid input has no result (no arm solution, no plan), that is a result with a reason, not one of these
errors.
"""


class PlannerError(Exception):
    """Input that the planner cannot use."""


class ArmTableError(PlannerError):
    """A table of arm parameters that the closed-form kinematics do not cover, or that is inconsistent."""


class ConfigurationNameError(PlannerError):
    """A name that is not one of the eight arm configurations."""


class PoseError(PlannerError):
    """A pose that is not a finite rigid transformation."""


class ScanFileError(PlannerError):
    """A scan file or another TOML file with a key, a value or a shape that is not allowed."""


class PathError(PlannerError):
    """A scan path, or its file, that the probe cannot follow."""


class WorkpieceError(PlannerError):
    """A workpiece with an implausible shape or size."""
