"""The scan planner: kinematics, configuration maps, planners, streaming and alignment."""
