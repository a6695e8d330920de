"""Meshes from files: read by gmsh or meshio, and checked."""
