"""A value factor of your own: poses with a high elbow are worth less. It counts in the map, and so in every plan.

As an installed plug-in it has a name that a scan file can use (`user_factors = ["low_elbow"]` in [value]):

    [project.entry-points."seventh_axis.factors"]
    low_elbow = "my_package:low_elbow"
"""

import numpy as np
from numpy.typing import NDArray

import planner


def low_elbow(poses: planner.RatedPoses) -> NDArray[np.float64]:
    """Return a number in 0..1 for each pose: 0 forbids it, 1 changes nothing."""
    shoulder_deg = np.degrees(poses.joints[:, 1])
    return np.clip((-shoulder_deg - 20.0) / 40.0, 0.0, 1.0)


slot = planner.Configuration.LEFTY_ABOVE_NOFLIP
scan = planner.load_scan("cylinder")
mine = planner.with_factors(scan, planner.UserFactor("low elbow", low_elbow))
for name, each in (("shipped factors", scan), ("with low_elbow", mine)):
    configuration_map = planner.build_maps(each, [slot], angle_count=90)[slot]
    print(f"{name:16} {configuration_map.allowed.mean():6.1%} of the cells allowed")
reasons = configuration_map.metadata["reasons"]
assert isinstance(reasons, dict)
code = next(code for code, text in reasons.items() if text == "excluded by low elbow")
print(f"{(configuration_map.reasons == code).sum()} cells have the reason {reasons[code]!r}")
