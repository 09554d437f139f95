"""The colors of a configuration map: gray by f_R where it is allowed, and a hue by reason where it is forbidden.

Families share a hue: reach blue, joint limits violet, the singularity amber, user factors green, collisions red.
"""

from collections.abc import Iterator, Mapping
from typing import NamedTuple

import numpy as np
from matplotlib.colors import to_rgb

from planner.arrays import CodeArray, FloatArray
from planner.map.config_map import ConfigurationMap
from planner.map.map_reasons import FIRST_PAIR, FIRST_USER_FACTOR
from planner.reasons import Reason

DARKEST_GRAY = 0.25
"""The gray level of the value 0: allowed cells must not look forbidden."""

_KINEMATIC = {
    Reason.OUT_OF_REACH: "#1d3557",
    Reason.SINGULAR: "#e09f3e",
    Reason.JOINT_1_LIMIT: "#3c1f6b",
    Reason.JOINT_2_LIMIT: "#5d3a9b",
    Reason.JOINT_3_LIMIT: "#7d5fb2",
    Reason.JOINT_4_LIMIT: "#9d83c8",
    Reason.JOINT_5_LIMIT: "#b79fd8",
    Reason.JOINT_6_LIMIT: "#cfbfe6",
}
_USER = ("#1b5e3b", "#2e8b57", "#66b88a", "#a3d6b9")
_COLLISION = ("#6a040f", "#9d0208", "#c9302c", "#e5645b", "#f09d93")
_OTHER_COLLISIONS = "#f7cdc7"


class LegendEntry(NamedTuple):
    """A displayed reason: its text, its color, and its share of the map's cells."""

    text: str
    color: str
    share: float


def colored(configuration_map: ConfigurationMap) -> tuple[FloatArray, list[LegendEntry]]:
    """Return the map as an RGB image `(n_angles, n_locations, 3)` and its legend, in descending order of frequency."""
    gray = DARKEST_GRAY + (1.0 - DARKEST_GRAY) * configuration_map.values.T
    image = np.repeat(gray[:, :, None], 3, axis=2)
    reasons = np.zeros(configuration_map.values.shape, dtype=np.uint8)
    if configuration_map.reasons is not None:
        reasons = configuration_map.reasons
    texts = configuration_map.metadata.get("reasons", {})
    assert isinstance(texts, Mapping)
    shares: dict[tuple[str, str], float] = {}
    for code, count, color in _by_frequency(reasons):
        image[code == reasons.T] = to_rgb(color)
        text = "other collisions" if color == _OTHER_COLLISIONS else str(texts.get(code, f"reason {code}"))
        shares[text, color] = shares.get((text, color), 0.0) + count / reasons.size
    return image, [LegendEntry(text, color, share) for (text, color), share in shares.items()]


def _by_frequency(reasons: CodeArray) -> list[tuple[int, int, str]]:
    """Return the codes in a map with their counts and colors, most frequent first."""
    codes, counts = np.unique(reasons[reasons != Reason.REACHED], return_counts=True)
    order = np.argsort(-counts, kind="stable")
    collisions = iter(_COLLISION)
    return [(int(codes[i]), int(counts[i]), _color(int(codes[i]), collisions)) for i in order]


def _color(code: int, collisions: Iterator[str]) -> str:
    if code >= FIRST_PAIR:
        return next(collisions, _OTHER_COLLISIONS)
    if code >= FIRST_USER_FACTOR:
        return _USER[(code - FIRST_USER_FACTOR) % len(_USER)]
    return _KINEMATIC[Reason(code)]
