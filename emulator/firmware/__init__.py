"""The firmware of the controller: fixed-point numbers, profiler, PID, and their work in each tick."""
