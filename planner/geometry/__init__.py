"""Shapes and distances: frames, capsules, meshes, distance fields and rays. It is independent of arms and tables."""
