"""Meshes from files: they are read in a process of limited time and memory, and checked."""
