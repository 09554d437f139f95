"""The execution of a plan on the table: streaming, monitoring, correction, verification and recording."""
