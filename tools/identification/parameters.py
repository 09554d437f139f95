"""The constants to estimate from a recording, as keys of the table's configuration."""

from collections.abc import Iterable
from dataclasses import replace
from math import exp, log
from typing import Any, NamedTuple

from emulator.config.table_config import TableConfig


class Parameter(NamedTuple):
    """A positive constant, estimated as its logarithm.

    `spread` is the prior standard deviation of that logarithm, around the configured value: 0.2 is 20 %. It is wide for
    constants that the recording identifies, narrow for those that it hardly identifies.
    """

    section: str
    key: str
    spread: float
    least: float = 1e-12
    most: float = 1e12

    def value(self, config: TableConfig) -> float:
        """Return the constant's value in a configuration."""
        return float(getattr(getattr(config, self.section), self.key))

    def set_log(self, config: TableConfig, logarithm: float) -> TableConfig:
        """Return the configuration with another value."""
        changes: dict[str, Any] = {self.key: min(max(exp(logarithm), self.least), self.most)}
        section: dict[str, Any] = {self.section: replace(getattr(config, self.section), **changes)}
        return replace(config, **section)

    def log_of(self, config: TableConfig) -> float:
        """Return the logarithm of the constant's value."""
        return log(max(self.value(config), self.least))


PARAMETERS = (
    Parameter("motor", "torque_constant_Nm_A", 0.8),
    Parameter("table", "inertia_kg_m2", 1.2),
    Parameter("friction", "coulomb_Nm", 1.0, least=1e-6),
    Parameter("gears", "backlash_arcmin", 1.5, least=0.05),
    Parameter("friction", "stiction_ratio", 0.2, least=1.0),
    Parameter("friction", "stribeck_speed_rad_s", 0.4),
    Parameter("motor", "rotor_inertia_kg_m2", 0.2),
    Parameter("gears", "efficiency", 0.15, most=1.0),
    Parameter("table", "bearing_friction_Nm", 0.4, least=1e-4),
    Parameter("friction", "viscous_Nm_s", 1.3, least=1e-9),
)

BACKLASH = 3
"""The index of the backlash: the search starts from several values of this constant."""


def with_logarithms(config: TableConfig, logarithms: Iterable[float]) -> TableConfig:
    """Return the configuration with values given by their logarithms, in the order of `PARAMETERS`."""
    for parameter, logarithm in zip(PARAMETERS, logarithms, strict=True):
        config = parameter.set_log(config, logarithm)
    return config
