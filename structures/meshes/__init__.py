"""Meshes from files, which gmsh or meshio reads, and their checks."""
