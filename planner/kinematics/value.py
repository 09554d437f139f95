"""The value function f_R of a pose: a product of named factors, each from 0 (forbidden) to 1 (section 3 of the paper).

    f_R = joint_1 x ... x joint_6  (Eq. (1) and (2))  x  wrist  x  clearance  x  user-defined factors

Each factor can be switched off, weighted by its exponent (gamma is that of Eq. (1)), and computed separately.
"""

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np

from planner.arrays import FloatArray, IndexArray
from planner.errors import ScanFileError
from planner.kernel import kernel
from planner.kinematics.arm import Arm
from planner.kinematics.configuration import Configuration
from planner.plug_ins import FACTOR_GROUP, PlugInError, failure, load_plug_in
from protocol.files.toml_table import TomlTable

JOINT_FACTORS = tuple(f"joint_{joint}" for joint in range(1, 7))
WRIST_FACTOR = "wrist"
CLEARANCE_FACTOR = "clearance"
FACTORS = (*JOINT_FACTORS, WRIST_FACTOR, CLEARANCE_FACTOR)

_NUMBERS = (
    "wrist_threshold_deg",
    "wrist_comfortable_deg",
    "wrist_weight",
    "minimum_clearance_mm",
    "comfortable_clearance_mm",
    "clearance_weight",
)
# The layout of the array for the kernels: the exponents in the order of FACTORS (0 switches a factor off, because x**0
# is 1), then the bounds.
WRIST_EXPONENT, CLEARANCE_EXPONENT = 6, 7
WRIST_THRESHOLD_RAD, WRIST_COMFORTABLE_RAD, MINIMUM_CLEARANCE_MM, COMFORTABLE_CLEARANCE_MM = 8, 9, 10, 11


class RatedPoses(NamedTuple):
    """Poses without a fault, one row each, as passed to a user's factor.

    Attributes:
        joints: `(n, 6)`, the robot's own angles, in radians.
        clearance_mm: `(n,)`, limited to the comfortable clearance.
        locations: `(n,)`, index of the scan location.
        table_angles_deg: `(n,)`.
    """

    joints: FloatArray
    clearance_mm: FloatArray
    locations: IndexArray
    table_angles_deg: FloatArray


class UserFactor(NamedTuple):
    """A user-defined factor: a name, and a function that rates all poses of a block, `(n,)`, each in 0..1."""

    name: str
    rate: Callable[[RatedPoses], FloatArray]


def plug_in_factor(name: str) -> UserFactor:
    """Return the factor of an installed package; its results are checked.

    Raises:
        PlugInError: there is no factor with that name, or it cannot be loaded; during the computation of maps: it
            failed.
    """
    rate = load_plug_in(FACTOR_GROUP, name)
    if not callable(rate):
        raise PlugInError(f"factor {name!r}: is not a function; it must take RatedPoses and return a number for each")

    def checked(poses: RatedPoses) -> FloatArray:
        count = len(poses.clearance_mm)
        try:
            rates = np.asarray(rate(poses), dtype=np.float64)
        except (Exception, SystemExit) as error:
            raise failure(FACTOR_GROUP, name, "failed", error) from error
        if rates.shape != (count,):
            raise PlugInError(f"factor {name!r}: returned an array of shape {rates.shape}; it must be ({count},)")
        if not ((rates >= 0.0) & (rates <= 1.0)).all():
            raise PlugInError(f"factor {name!r}: returned a value outside 0 to 1")
        return rates

    return UserFactor(name, checked)


@dataclass(frozen=True)
class ValueFunction:
    """The configuration of f_R.

    Attributes:
        factors: names of the active factors, from `FACTORS`. A hard limit is enforced without its factor too: a joint
            beyond its range has no solution to rate.
        gamma: exponents of Eq. (1), one per joint.
        wrist_threshold_deg: |J5| up to which the wrist is singular (factor 0).
        wrist_comfortable_deg: |J5| from which on the wrist is far from the singularity (factor 1).
        wrist_weight: exponent of the wrist factor.
        minimum_clearance_mm: clearance up to which bodies collide (factor 0).
        comfortable_clearance_mm: clearance from which on bodies are far from each other (factor 1).
        clearance_weight: exponent of the clearance factor.
        user_factors: additional factors.

    Raises:
        ValueError: an unknown factor, an exponent below 0, or bounds in the wrong order.
    """

    factors: frozenset[str] = frozenset(FACTORS)
    gamma: tuple[float, ...] = (0.2,) * 6
    wrist_threshold_deg: float = 5.0
    wrist_comfortable_deg: float = 20.0
    wrist_weight: float = 1.0
    minimum_clearance_mm: float = 5.0
    comfortable_clearance_mm: float = 30.0
    clearance_weight: float = 1.0
    user_factors: tuple[UserFactor, ...] = ()

    def __post_init__(self) -> None:
        unknown = sorted(self.factors - set(FACTORS))
        if unknown:
            raise ValueError(f"{unknown[0]!r} is not a factor of the value function; allowed are {', '.join(FACTORS)}")
        if len(self.gamma) != 6 or not all(0.0 <= exponent < math.inf for exponent in self.exponents):
            raise ValueError(f"exponents are {self.exponents}; required are 8 finite numbers, at least 0")
        if not 0.0 <= self.wrist_threshold_deg < self.wrist_comfortable_deg < math.inf:
            raise ValueError(
                f"the wrist is singular up to {self.wrist_threshold_deg:g} deg and comfortable from "
                f"{self.wrist_comfortable_deg:g} deg; the first must be smaller, and not negative"
            )
        if not 0.0 <= self.minimum_clearance_mm < self.comfortable_clearance_mm < math.inf:
            raise ValueError(
                f"the clearance is too small up to {self.minimum_clearance_mm:g} mm and comfortable from "
                f"{self.comfortable_clearance_mm:g} mm; the first must be smaller, and not negative"
            )

    @property
    def exponents(self) -> tuple[float, ...]:
        """The eight exponents, in the order of `FACTORS`."""
        return (*self.gamma, self.wrist_weight, self.clearance_weight)

    @property
    def table(self) -> FloatArray:
        """The value function for the kernels: `(12,)`; the indices are named at the top of this file."""
        on = (exponent * (name in self.factors) for name, exponent in zip(FACTORS, self.exponents, strict=True))
        wrist = math.radians(self.wrist_threshold_deg), math.radians(self.wrist_comfortable_deg)
        return np.array([*on, *wrist, self.minimum_clearance_mm, self.comfortable_clearance_mm])

    def only(self, names: Iterable[str]) -> "ValueFunction":
        """Return the value function with only the named factors, to show the contribution of each.

        Raises:
            ValueError: a name is not in `FACTORS` and not a user-defined factor.
        """
        wanted = frozenset(names)
        chosen = tuple(factor for factor in self.user_factors if factor.name in wanted)
        return replace(self, factors=wanted - {factor.name for factor in chosen}, user_factors=chosen)

    @classmethod
    def read(cls, table: TomlTable) -> "ValueFunction":
        """Return the value function for a table of a scan file; missing keys have their defaults.

        The keys are the attributes' names, and the factors' names with "on" or "off"; `user_factors` is a list of the
        names of installed plug-ins (`planner.plug_ins`).

        Raises:
            ScanFileError: a key is unknown, or a value is not allowed.
            PlugInError: a factor is not installed, or cannot be loaded.
        """
        default = cls()
        on = frozenset(name for name in FACTORS if table.choice(name, ("on", "off"), "on") == "on")
        gamma = table.numbers("gamma", 6, default.gamma)
        numbers: dict[str, Any] = {name: table.number(name, getattr(default, name), at_least=0.0) for name in _NUMBERS}
        own = table.texts("user_factors")
        if len(set(own)) < len(own):
            raise table.refuse("user_factors", "a list of different names")
        table.finish()
        try:
            return replace(default, factors=on, gamma=gamma, user_factors=tuple(map(plug_in_factor, own)), **numbers)
        except ValueError as error:
            raise ScanFileError(f"{table.file}: {error}") from error


def joint_ranges(arm: Arm) -> FloatArray:
    """Return `(8, 6, 2)`: the lower and upper end in radians of each joint's range within each arm configuration.

    There is a singularity inside the full range of joint 5 (axes 4 and 6 aligned at 0) and of joint 3 (arm stretched).
    Eq. (1) over the full range would give it the highest value. But a configuration covers only one side: FLIP has the
    negative half of joint 5's range and NOFLIP the positive one. ABOVE and BELOW have the stretched arm as their common
    boundary.
    """
    ranges = np.empty((len(Configuration), 6, 2))
    ranges[:] = arm.limits.T
    # Mirrored twists reverse the direction of joint 3 (see `planner.kinematics.inverse_kinematics`).
    sense = -math.copysign(1.0, arm.alpha_deg[0])
    stretched = sense * math.atan2(arm.d_mm[3], arm.a_mm[2])
    for slot in Configuration:
        bends_down = slot.above == slot.lefty
        _keep_half(ranges[slot, 2], stretched, upper=bends_down == (sense > 0))
        _keep_half(ranges[slot, 4], 0.0, upper=not slot.flip)
    return ranges


def _keep_half(limits: FloatArray, split: float, *, upper: bool) -> None:
    """Cut a joint's range at `split`. If nothing remains, keep it: then no solution has this configuration."""
    if limits[0] < split < limits[1]:
        limits[0 if upper else 1] = split


@kernel
def joint_factor(angle: float, lower: float, upper: float, gamma: float) -> float:
    """Return f_j of Eq. (1): 1 in the middle of the joint's range, 0 at its ends and beyond.

    The sine is computed from the nearer end, so that it is 0 at both (in floating point sin(pi) is not).
    """
    from_end = max(min(angle - lower, upper - angle) / (upper - lower), 0.0)
    return float(math.sin(math.pi * from_end) ** gamma)


@kernel
def joints_value(value: FloatArray, joints: FloatArray, ranges: FloatArray, slot: int) -> tuple[float, float, int]:
    """Return f_R of Eq. (2), the product of the joint factors, with the smallest one and its joint 0..5.

    Args:
        value: `ValueFunction.table`.
        joints: `(8, 6)`, in radians.
        ranges: `(8, 6, 2)`, see `joint_ranges`.
        slot: the arm configuration.
    """
    product, least, worst = 1.0, 1.0, 0
    for j in range(6):
        factor = joint_factor(joints[slot, j], ranges[slot, j, 0], ranges[slot, j, 1], value[j])
        product *= factor
        if factor < least:
            least, worst = factor, j
    return product, least, worst


@kernel
def _rising_factor(value: float, zero_at: float, one_at: float, exponent: float) -> float:
    """Return 0 up to `zero_at`, 1 from `one_at` on, linear in between, all raised to `exponent`."""
    rise = (value - zero_at) / (one_at - zero_at)
    return float(min(max(rise, 0.0), 1.0) ** exponent)


@kernel
def wrist_factor(value: FloatArray, joint_5: float) -> float:
    """Return the wrist-singularity factor: |J5| is the angle between the axes of joints 4 and 6."""
    return _rising_factor(abs(joint_5), value[WRIST_THRESHOLD_RAD], value[WRIST_COMFORTABLE_RAD], value[WRIST_EXPONENT])


@kernel
def clearance_factor(value: FloatArray, clearance_mm: float) -> float:
    """Return the collision factor."""
    return _rising_factor(
        clearance_mm, value[MINIMUM_CLEARANCE_MM], value[COMFORTABLE_CLEARANCE_MM], value[CLEARANCE_EXPONENT]
    )
