"""A short scan: a cylinder of 100 mm."""

SMALL = """
[cell]
workpiece_on_table = [0, 0, 80, 0, 0, 0]
[workpiece]
class = "cylinder"
diameter_mm = 100
height_mm = 100
[path]
pattern = "rings"
bottom_margin_mm = 20
scan_speed_mm_s = 25
time_step_s = 0.5
"""
