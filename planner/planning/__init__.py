"""The planners on the map, from rotate-when-blocked to the optimum, and the choice of the arm configuration."""
