"""What is scanned, where, and past what: the cell, its bodies, the workpiece, the scan path, and all clearances."""
