"""Shapes and distances: frames, capsules, meshes, distance fields and rays. It knows nothing of arms and tables."""
