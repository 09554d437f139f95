"""The planners on the map, from rotate-when-blocked to the optimum, and their plans."""
