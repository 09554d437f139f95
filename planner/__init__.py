"""The scan planner: kinematics, configuration maps, planners, streaming and alignment."""

import protocol.quiet_start  # noqa: F401 - before the imports that take long
