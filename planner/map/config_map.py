"""The grayscale configuration map: f_R over scan locations and table angles (section 3 of the paper, Fig. 6).

The map contains f_R only at its samples. Between samples it is interpolated, and the exact border of a forbidden region
is unknown there. So a cell counts as allowed only if every sample with a weight in it is allowed.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType

import numpy as np

from planner.arrays import BoolArray, CodeArray, FloatArray
from planner.errors import PlannerError
from planner.kernel import kernel

# sin(pi)**0.2, Eq. (1) at the end of a joint's range in floating point, is 6.6e-4 and still means "forbidden".
DEFAULT_EPSILON = 1e-3

# An angle this close to a sample, in samples, is on it: exact motions have rounding errors.
SAMPLE_TOLERANCE = 1e-9


@kernel
def sample_at_or_below(position: float) -> int:
    """Return the nearest sample at or below `position` (in samples, unwrapped)."""
    return int(np.floor(position + SAMPLE_TOLERANCE))


@kernel
def sample_at_or_above(position: float) -> int:
    """Return the nearest sample at or above `position` (in samples, unwrapped)."""
    return int(np.ceil(position - SAMPLE_TOLERANCE))


@kernel
def wrapped(sample: int, count: int) -> int:
    """Return `sample` modulo `count` without an integer division, the slowest operation of a look-up."""
    return int(sample - count * np.floor((sample + 0.5) * (1.0 / count)))


@kernel
def column_value(values: FloatArray, epsilon: float, location: int, angle_deg: float) -> float:
    """Return f_R at a scan location and any (unwrapped) table angle; 0 where it is forbidden.

    Linear between the two neighboring samples, and 0 unless each of them with a nonzero weight exceeds `epsilon`.
    """
    count: int = values.shape[1]
    position = angle_deg * (count / 360.0)
    below = sample_at_or_below(position)
    fraction = position - below
    index = wrapped(below, count)
    lower = float(values[location, index])
    if lower <= epsilon:
        return 0.0
    if fraction <= SAMPLE_TOLERANCE:
        return lower
    upper = float(values[location, index + 1 if index + 1 < count else 0])
    if upper <= epsilon:
        return 0.0
    return lower + fraction * (upper - lower)


@kernel
def map_value(values: FloatArray, epsilon: float, location: float, angle_deg: float) -> float:
    """Return f_R at any point of the map, between scan locations too; 0 where it is forbidden.

    Bilinear in (location, angle), periodic in angle, and 0 unless each sample with a nonzero weight exceeds `epsilon`.

    Args:
        values: (n_locations, n_angles) samples of f_R.
        epsilon: maximum value that still means "forbidden".
        location: 0 .. n_locations - 1; fractions are between two scan locations.
        angle_deg: table angle, unwrapped.
    """
    before = sample_at_or_below(location)
    after = sample_at_or_above(location)
    earlier = column_value(values, epsilon, before, angle_deg)
    if before >= after:
        return earlier
    later = column_value(values, epsilon, after, angle_deg)
    if earlier <= epsilon or later <= epsilon:
        return 0.0
    return earlier + (location - before) * (later - earlier)


class ConfigurationMapError(PlannerError):
    """Samples of f_R that are not a configuration map, or a look-up outside of it."""


@dataclass(frozen=True, eq=False)
class ConfigurationMap:
    """Samples of f_R for one arm configuration; the angle axis is periodic.

    Sample (k, i) is f_R at scan location k and table angle i * 360 / n_angles degrees. Arrays are copied and read-only.

    Attributes:
        values: (n_locations, n_angles), 0 (forbidden) to 1.
        reasons: (n_locations, n_angles) codes for why a sample is forbidden, or None.
        epsilon: a pose is allowed ("inrange") where f_R > epsilon.
        metadata: additional data of the map: configuration, provenance, settings.
    """

    values: FloatArray
    reasons: CodeArray | None = None
    epsilon: float = DEFAULT_EPSILON
    metadata: Mapping[str, object] = field(default_factory=dict)

    def __post_init__(self) -> None:
        """Check the samples and freeze them."""
        values = np.array(self.values, dtype=np.float64, order="C")
        _check_values(values)
        if not 0.0 <= self.epsilon < 1.0:
            raise ConfigurationMapError(f"the map's epsilon is {self.epsilon}; allowed: 0 up to, but not including, 1")
        values.setflags(write=False)
        object.__setattr__(self, "values", values)
        object.__setattr__(self, "metadata", MappingProxyType(dict(self.metadata)))
        if self.reasons is not None:
            object.__setattr__(self, "reasons", _frozen_reasons(self.reasons, values.shape))

    @property
    def location_count(self) -> int:
        """Number of scan locations: the columns of the map."""
        return int(self.values.shape[0])

    @property
    def angle_count(self) -> int:
        """Number of sampled table angles over one turn."""
        return int(self.values.shape[1])

    @property
    def angle_step_deg(self) -> float:
        """Distance of neighboring samples along the angle axis."""
        return 360.0 / self.angle_count

    @property
    def angles_deg(self) -> FloatArray:
        """The (n_angles,) sampled table angles, from 0 up to, but not including, 360."""
        return np.linspace(0.0, 360.0, self.angle_count, endpoint=False)

    @property
    def allowed(self) -> BoolArray:
        """(n_locations, n_angles): which samples are allowed."""
        return self.values > self.epsilon

    @property
    def blocked_locations(self) -> tuple[int, ...]:
        """The scan locations without an allowed angle."""
        return tuple(int(k) for k in np.flatnonzero(~self.allowed.any(axis=1)))

    def value(self, location: float, angle_deg: float) -> float:
        """Return the interpolated f_R at a point of the map (see `map_value`); 0 where it is forbidden."""
        if not 0.0 <= location <= self.location_count - 1:
            raise ConfigurationMapError(
                f"location {location} is outside of the map; allowed: 0 to {self.location_count - 1}"
            )
        return float(map_value(self.values, self.epsilon, float(location), float(angle_deg)))

    def is_allowed(self, location: float, angle_deg: float) -> bool:
        """Return the paper's `inrange`: whether f_R > epsilon at this point of the map."""
        return self.value(location, angle_deg) > self.epsilon

    def forbidden_distance_deg(self, location: int, angle_deg: float) -> float:
        """Return the distance along the angle axis to the nearest forbidden sample of a location, or infinity."""
        forbidden_deg = self.angles_deg[~self.allowed[location]]
        ways_deg = np.abs((forbidden_deg - angle_deg + 180.0) % 360.0 - 180.0)
        return float(ways_deg.min(initial=np.inf))


def _check_values(values: FloatArray) -> None:
    if values.ndim != 2 or values.shape[0] < 1 or values.shape[1] < 2:
        raise ConfigurationMapError(
            f"a configuration map needs values of shape (locations >= 1, angles >= 2); the shape is {values.shape}"
        )
    wrong = ~((values >= 0.0) & (values <= 1.0))
    if wrong.any():
        k, i = (int(index) for index in np.argwhere(wrong)[0])
        raise ConfigurationMapError(
            f"the map's value at location {k}, angle index {i} is {values[k, i]}; allowed: 0 to 1"
        )


def _frozen_reasons(reasons: CodeArray, shape: tuple[int, ...]) -> CodeArray:
    frozen = np.array(reasons, dtype=np.uint8, order="C")
    if frozen.shape != shape:
        raise ConfigurationMapError(
            f"the map's reasons have shape {frozen.shape}; it must be that of its values, {shape}"
        )
    frozen.setflags(write=False)
    return frozen
