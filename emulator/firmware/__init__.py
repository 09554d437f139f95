"""The controller's program: fixed-point numbers, profiler, PID, and what they do at each tick."""
