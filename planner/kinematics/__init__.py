"""The arm: its configurations, its inverse kinematics, and what a posture of it is worth (Eq. 1 and 2)."""
