"""The planners on the map, from rotate-when-blocked to the optimum, and the plan that each of them returns."""
