"""The cell: frames, bodies, obstacles, workpiece, scan path, and clearances."""
