"""The arm: its configurations, its inverse kinematics, and the rating of its postures (Eq. 1 and 2)."""
