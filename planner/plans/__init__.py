"""What a planner is asked and what it answers: problem and plan, their checks, the file and the pictures of a plan."""
