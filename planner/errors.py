"""The errors that the planner raises for input that cannot be used.

Each says in one sentence what is wrong, where, and what is allowed, so that a command line can print it as it is.
What a sound input merely cannot achieve (no arm solution, no plan) is a result with a reason and never one of these.
"""


class PlannerError(Exception):
    """Input that the planner cannot use."""


class ArmTableError(PlannerError):
    """A table of arm parameters that the closed-form kinematics do not cover, or that contradicts itself."""


class ConfigurationNameError(PlannerError):
    """A name that is none of the eight arm configurations."""


class PoseError(PlannerError):
    """A pose that is not a finite rigid transformation."""


class ScanFileError(PlannerError):
    """A scan file, or another TOML file, with a key, a value or a shape that is not allowed."""


class PathError(PlannerError):
    """A scan path, or a file of one, that the probe cannot follow."""


class WorkpieceError(PlannerError):
    """A workpiece whose shape or size cannot be meant."""
