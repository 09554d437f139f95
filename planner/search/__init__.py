"""The state spaces of map and arm, and how they are searched: lattices, grids, intervals, cost-to-go, proofs."""
